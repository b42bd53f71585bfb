// A map as coloured points, lines and triangles: what every format can be written from.
//
// All coordinates are metres in the world frame, z up. A layer is what a user would switch on and
// off in a viewer; it may be empty.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "data/progress.h"
#include "mapping/map.h"

namespace slcmap {

struct Colour {
  uint8_t red = 255, green = 255, blue = 255;
};

// Vertices with a colour each.
struct Vertices {
  std::vector<Eigen::Vector3d> positions;
  std::vector<Colour> colours;

  std::size_t size() const { return positions.size(); }
  void Add(const Eigen::Vector3d& position, const Colour& colour) {
    positions.push_back(position);
    colours.push_back(colour);
  }
};

struct PointLayer {
  std::string name;
  Vertices vertices;
};

// Straight edges between pairs of vertices.
struct LineLayer {
  std::string name;
  Vertices vertices;
  std::vector<std::array<uint32_t, 2>> edges;
};

// Triangles, counter-clockwise seen from outside.
struct MeshLayer {
  std::string name;
  Vertices vertices;
  std::vector<std::array<uint32_t, 3>> triangles;
};

struct MapScene {
  std::string map_id, run_id;  // of what it shows; "" where that is not known
  Eigen::Vector3d world_offset_m = Eigen::Vector3d::Zero();  // as MapSource has it
  std::vector<PointLayer> points;
  std::vector<LineLayer> lines;
  std::vector<MeshLayer> meshes;
};

struct SceneOptions {
  double frustum_m = 0.2;          // length of a drawn camera
  double frustum_spacing_m = 0.5;  // keyframes nearer to the last drawn one are left out
  double max_jump_s = 0.5;   // the trajectory is not drawn across longer gaps, see TrajectoryGap_s
  double line_bar_m = 0.04;  // width of lines that are drawn as bars
  int max_vertices = 8000000;  // of all layers; some 200 bytes of memory each, with writing
  void Check() const;          // throws ConfigError
};

// The layers of a map: points ("points", coloured by height), lines ("lines" coloured by axis and
// age, "trajectory" by time, "keyframes": a frustum of the left camera each) and meshes ("voxels",
// coloured by height, and "line_bars": the lines once more, for viewers that draw edges a pixel
// wide, without their colours or not at all). Throws ConfigError for a map that takes more than
// max_vertices, before any is made, and StoppedError when progress says so.
MapScene MakeScene(const MapResult& map, const SceneOptions& options,
                   const Progress& progress = {});

}  // namespace slcmap
