// Where rays went through, as a grid of the plan of one storey.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
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

  // Those of another space of the same box and cells.
  void AddWaysOf(const FreeSpace& other);

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

// The rays of all sights, or every so manieth if there are as many as max_rays.
class SightRays {
 public:
  // `sights` must outlive it.
  SightRays(const std::vector<Sights>& sights, size_t max_rays);

  size_t views() const { return sights_.size(); }

  // Calls use(p_world_camera, end, sigma_m) for the rays of a view.
  template <typename Use>
  void ForEachOf(size_t view, Use use) const {
    const Sights& of_view = sights_[view];
    for (size_t i = first_[view]; i < of_view.p_world.size(); i += step_) {
      use(of_view.p_world_camera, Eigen::Vector3d(of_view.p_world[i].cast<double>()),
          static_cast<double>(of_view.sigma_m[i]));
    }
  }

  // Calls work(begin, end) for some views at a time. Throws StoppedError once progress says so.
  template <typename Work>
  void ForSomeViews(const Progress& progress, Work work) const {
    constexpr size_t kAtOnce = 8;
    for (size_t begin = 0; begin < views(); begin += kAtOnce) {
      progress.ReportOrStop(static_cast<double>(begin) / static_cast<double>(views()));
      work(begin, std::min(views(), begin + kAtOnce));
    }
  }

 private:
  const std::vector<Sights>& sights_;
  size_t step_ = 1;
  std::vector<size_t> first_;  // by view, of those that count
};

}  // namespace slcmap
