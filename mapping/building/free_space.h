// Where rays went through, as a grid of the plan of one storey.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "data/polygon.h"
#include "mapping/building/building_input.h"

namespace slcmap {

class FreeSpace {
 public:
  // Covers the box, in cells of that side. Metres, in world.
  FreeSpace(const Eigen::AlignedBox2d& box, double cell_m);

  // Marks the way between two points.
  void AddWay(const Eigen::Vector2d& from, const Eigen::Vector2d& to);

  bool IsFree(const Eigen::Vector2d& point) const;

  // The part of a polygon that is free, 0 to 1; of one that is smaller than a cell, whether its
  // first corner is.
  double ShareOf(const Polygon& polygon) const;

  // Around the middles of all cells that are free, along turned axes; empty where nothing is.
  Eigen::AlignedBox2d FreeBox(const Eigen::Rotation2Dd& R_box_world) const;

 private:
  int64_t IndexOf(const Eigen::Vector2d& point) const;  // -1: outside

  Eigen::AlignedBox2d box_;
  double cell_m_;
  int64_t columns_, rows_;
  std::vector<uint8_t> ways_;  // through a cell, at most 255
};

// The part of a ray between two heights, without what of its end is uncertain; false: none.
bool ClipRay(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double end_m, double low_m,
             double high_m, Eigen::Vector3d* start, Eigen::Vector3d* end);

}  // namespace slcmap
