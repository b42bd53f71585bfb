// What stands, hangs and lies in a simulated building.
#pragma once

#include <string>
#include <vector>

#include "data/simulator/scene/scene_builder.h"

namespace slcmap::inline data {

// All in the frame of the builder's placement, z up, in metres. `size` is width (x), depth (y) and
// height (z). Standing things are centred on the origin, with it at their foot. Things at a wall
// have it in the plane y = 0 behind them, the origin at the middle of their foot, and face -y.
// Materials are indices; seeds decide details.

// Standing.
void AddCrate(const Eigen::Vector3d& size, uint32_t wood, SceneBuilder* builder);
void AddPallet(const Eigen::Vector3d& size, uint32_t wood, SceneBuilder* builder);
void AddTable(const Eigen::Vector3d& size, uint32_t top, uint32_t legs, SceneBuilder* builder);
void AddChair(uint32_t seat, uint32_t legs, SceneBuilder* builder);
void AddMonitor(uint32_t screen, uint32_t body, SceneBuilder* builder);
void AddMachine(const Eigen::Vector3d& size, uint32_t body, uint32_t metal, uint32_t seed,
                SceneBuilder* builder);
void AddDrum(double radius, double height, uint32_t metal, SceneBuilder* builder);
void AddLadder(double width, double length, uint32_t metal, SceneBuilder* builder);
// Boxes of all sizes up to max_side, at any heading, strewn over size.x() by size.y(), none through
// another; some lie tilted on their edges if `tilted`.
void AddClutter(const Eigen::Vector2d& size, double max_side, int count, bool tilted,
                const std::vector<uint32_t>& materials, uint32_t seed, SceneBuilder* builder);

// At a wall.
void AddPoster(const Eigen::Vector2d& size, uint32_t seed, SceneBuilder* builder);
// An AprilTag or ArUco tag whose middle is the origin; `size` is the side of its black square.
void AddTag(const std::string& name, double size, SceneBuilder* builder);
// With a frame and some sheets.
void AddBoard(const Eigen::Vector2d& size, uint32_t face, uint32_t frame, uint32_t seed,
              SceneBuilder* builder);
void AddCabinet(const Eigen::Vector3d& size, int doors, uint32_t body, uint32_t metal,
                SceneBuilder* builder);
void AddShelf(const Eigen::Vector3d& size, int boards, uint32_t wood,
              const std::vector<uint32_t>& contents, uint32_t seed, SceneBuilder* builder);
void AddRadiator(const Eigen::Vector3d& size, uint32_t metal, SceneBuilder* builder);
void AddExtinguisher(uint32_t body, uint32_t metal, SceneBuilder* builder);

// From point to point.
void AddPipeRun(const std::vector<Eigen::Vector3d>& points, double radius, int sides,
                uint32_t material, SceneBuilder* builder);
void AddRailing(const std::vector<Eigen::Vector3d>& points, double height, uint32_t material,
                SceneBuilder* builder);
// Sags by `sag` in its middle.
void AddCable(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double sag, double radius,
              uint32_t material, SceneBuilder* builder);

// Goes up along x, its first riser at x = 0; closed boards at both sides and a slab beneath.
void AddStairs(int steps, double rise, double run, double width, uint32_t step, uint32_t side,
               SceneBuilder* builder);
// Shines down; the origin is the middle of its top.
void AddCeilingLamp(const Eigen::Vector2d& size, double radiance, uint32_t lamp, uint32_t housing,
                    SceneBuilder* builder);

}  // namespace slcmap::data
