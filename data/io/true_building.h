// What is true of a simulated building as a whole: its walls with their openings, and its rooms.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "data/core/polygon.h"

namespace slcmap::inline data {

// Metres, in the world of the simulator's trajectory.
struct TrueOpening {
  int64_t id = 0;  // the same on both faces of a wall
  bool is_door = true;
  bool is_open = false;       // one sees and goes through; closed doors and panes are not
  bool is_clear = false;      // a pane of clear glass, which one sees through
  double looked_through = 0;  // share that a camera saw through or onto, at most 8 m away
  double clear_width_m = 0;
  std::vector<Eigen::Vector3d> outline_world;
};

// One side of a wall. A bent one is told by points on it.
struct TrueWall {
  int64_t id = 0;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitX();  // of its plane of least squares, outwards
  double offset_m = 0;                                // normal . p of the points on that plane
  double seen_m2 = 0;                                 // by a camera at most 8 m away
  std::vector<Eigen::Vector3d> outline_world;
  std::vector<Eigen::Vector3d> seen_world;  // points of a grid on the face that were seen
  std::vector<TrueOpening> openings;
};

struct TrueRoom {
  int64_t id = 0;
  Polygon polygon;  // in world, x and y
  double area_m2 = 0;
  double floor_m = 0;
  double height_m = 0;      // 0: without a ceiling
  bool is_entered = false;  // by the left camera
};

struct TrueBuilding {
  double cell_m = 0.4;  // of the grid of points on walls
  std::vector<TrueWall> walls;
  std::vector<TrueRoom> rooms;
};

// Throws OutputError.
void WriteTrueBuilding(const std::string& path, const TrueBuilding& building);

// Throws DataError naming the file and what is wrong in it.
TrueBuilding ReadTrueBuilding(const std::string& path);

}  // namespace slcmap::data
