// Walls of a simulated building with their doors, windows and skirting.
#pragma once

#include <vector>

#include "data/simulator/scene/scene_builder.h"

namespace slcmap::inline data {

// A door or a window in a segment of a wall. Metres, degrees.
struct WallOpening {
  int segment = 0;
  double along = 0;  // from the segment's first point to the opening's near side
  double width = 0.9, height = 2.05;
  double sill = 0;      // above the foot of the wall; a door's is 0
  double open_deg = 0;  // of a door's leaf, to the side away from the wall's front
  double radiance = 0;  // of a window's daylight
  bool is_door = true;
};

// A wall along `points`, whose front is to the left of the way from point to point.
struct WallSpec {
  std::vector<Eigen::Vector2d> points;
  bool closed = false;
  double height = 2.7;
  double thickness = 0.15;            // behind the front
  bool has_back = false;              // the back face, and ends
  double skirting_height = 0;         // 0: none
  bool is_solid = false;              // although it has no back face
  bool is_told = true;                // as faces of walls, in what is true
  bool has_leaf = true;               // in each door
  bool clear_glass = false;           // windows without daylight are seen through, and mirror
  std::vector<WallOpening> openings;  // disjoint along each segment
  uint32_t material = 0, skirting = 0, frame = 0, leaf = 0, metal = 0, glass = 0, daylight = 0;
};

// In the frame of the current placement: the foot of the wall at z = 0.
void AddWall(const WallSpec& spec, const Eigen::Isometry3d& wing_object, int wing,
             SceneBuilder* builder);

}  // namespace slcmap::data
