#include "apps/evaluation/occupancy_metrics.h"

#include <algorithm>
#include <cmath>

#include "apps/evaluation/no_figure.h"

namespace slcmap {
namespace {

constexpr double kBehind_m = 0.5;
constexpr std::size_t kEveryRay = 20;
constexpr int kMarginCells = 2;       // of ends: walls are not where cells begin
constexpr double kSkin_m = 1e-4;      // by which a ray to a point on a surface ends before it
constexpr std::size_t kLookouts = 4;  // one view in as many is looked from at what is behind ends

bool IsOccupiedNearby(const OccupancyMap& occupancy, const Eigen::Vector3d& p) {
  for (int i = 0; i < 27; ++i) {
    const Eigen::Vector3d offset(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
    if (occupancy.IsOccupied(p + occupancy.resolution_m() * offset)) return true;
  }
  return false;
}

// Counts over all rays.
class Counter {
 public:
  Counter(const TriangleTree& surfaces, const std::vector<ReferenceView>& views,
          const OccupancyMap& occupancy, const RigidTransform& T_map_truth)
      : surfaces_(surfaces),
        occupancy_(occupancy),
        T_map_truth_(T_map_truth),
        cell_m_(occupancy.resolution_m()) {
    for (std::size_t i = 0; i < views.size(); i += kLookouts) {
      lookouts_.push_back(views[i].p_camera);
    }
  }

  void Count(const Eigen::Vector3d& p_camera, const Eigen::Vector3d& end) {
    const Eigen::Vector3d p_map = T_map_truth_ * end;
    ++rays_;
    occupied_ends_ += occupancy_.IsOccupied(p_map);
    nearby_ends_ += IsOccupiedNearby(occupancy_, p_map);
    const double range_m = (end - p_camera).norm(), margin_m = kMarginCells * cell_m_;
    const Eigen::Vector3d direction = (end - p_camera) / range_m;
    for (double at_m = 0; at_m <= range_m - margin_m; at_m += cell_m_) {
      CountPassage(p_camera + at_m * direction);
    }
    for (double at_m = margin_m; at_m <= kBehind_m; at_m += 2 * cell_m_) {
      CountBehind(end + at_m * direction);
    }
  }

  OccupancyMetrics Metrics() const {
    return {rays_,
            ComputeShare(occupied_ends_, rays_),
            ComputeShare(nearby_ends_, rays_),
            ComputeShare(known_, passages_),
            ComputeShare(free_, known_),
            behind_,
            ComputeShare(behind_free_, behind_)};
  }

 private:
  void CountPassage(const Eigen::Vector3d& p) {
    const bool is_free = occupancy_.IsFree(T_map_truth_ * p);
    ++passages_;
    known_ += is_free || occupancy_.IsOccupied(T_map_truth_ * p);
    free_ += is_free;
  }

  void CountBehind(const Eigen::Vector3d& p) {
    // What is near a surface shares a cell with what is before it.
    if (surfaces_.Distance_m(p, cell_m_) < cell_m_) return;
    if (std::any_of(lookouts_.begin(), lookouts_.end(),
                    [&](const Eigen::Vector3d& lookout) { return IsSeen(lookout, p); })) {
      return;
    }
    ++behind_;
    behind_free_ += occupancy_.IsFree(T_map_truth_ * p);
  }

  bool IsSeen(const Eigen::Vector3d& lookout, const Eigen::Vector3d& p) const {
    const double range_m = (p - lookout).norm() - kSkin_m;
    return !std::isfinite(surfaces_.FirstHit_m(lookout, (p - lookout).normalized(), range_m));
  }

  const TriangleTree& surfaces_;
  const OccupancyMap& occupancy_;
  const RigidTransform T_map_truth_;
  const double cell_m_;
  std::vector<Eigen::Vector3d> lookouts_;
  int64_t rays_ = 0, occupied_ends_ = 0, nearby_ends_ = 0;
  int64_t passages_ = 0, known_ = 0, free_ = 0, behind_ = 0, behind_free_ = 0;
};

}  // namespace

OccupancyMetrics EvaluateOccupancy(const TriangleTree& surfaces,
                                   const std::vector<ReferenceView>& views,
                                   const OccupancyMap& occupancy, const Alignment& alignment,
                                   const Progress& progress) {
  Counter counter(surfaces, views, occupancy, alignment.T_truth_estimate.Inverse());
  std::size_t next = 0, ray = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(views.size()));
    for (const Eigen::Vector3d& end : views[i].ends) {
      if (ray++ != next) continue;
      next += kEveryRay;
      counter.Count(views[i].p_camera, end);
    }
  }
  return counter.Metrics();
}

}  // namespace slcmap
