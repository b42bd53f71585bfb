// Where rays went through, as a grid of the plan of one storey.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "data/polygon.h"
#include "data/progress.h"
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

// In the plan.
struct FreeWay {
  Eigen::Vector2d from, to;
};

// Where the ray from a camera to a point that is known up to sigma_m tells, between a storey's
// floor and top, that nothing stands: without what is near these, and without its end, of a cell at
// least.
std::optional<FreeWay> FreeWayOf(const Eigen::Vector3d& p_world_camera, const Eigen::Vector3d& end,
                                 double sigma_m, double floor_m, double top_m, double cell_m);

// Calls use(view, p_world_camera, end, sigma_m) for the rays of all sights, or every so manieth if
// there are as many as max_rays. Throws StoppedError once progress says so.
template <typename Use>
void ForEachRay(const std::vector<Sights>& sights, size_t max_rays, const Progress& progress,
                Use use) {
  size_t rays = 0;
  for (const Sights& view : sights) rays += view.p_world.size();
  const size_t step = rays / max_rays + 1;
  size_t next = 0;  // in the views that come
  for (size_t i = 0; i < sights.size(); ++i) {
    progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(sights.size()));
    const Sights& view = sights[i];
    for (; next < view.p_world.size(); next += step) {
      use(i, view.p_world_camera, Eigen::Vector3d(view.p_world[next].cast<double>()),
          static_cast<double>(view.sigma_m[next]));
    }
    next -= view.p_world.size();
  }
}

}  // namespace slcmap
