#include "mapping/merge/cloud_sights.h"

#include <algorithm>
#include <limits>

#include "mapping/lines/sight_depths.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap {
namespace {

constexpr int kSightCell_px = 16;
constexpr double kNearest_m = 0.2, kFarthest_m = 10;
constexpr std::size_t kViewsAtOnce = 16;  // whose depth is in memory

// Whether a way leads through free space but for short parts, as beside surfaces, and its ends.
bool IsFreeWay(const OccupancyMap& occupancy, const Eigen::Vector3d& from,
               const Eigen::Vector3d& to) {
  constexpr double kAtStart_m = 0.3, kAtEnd_m = 0.15, kMostBlocked_m = 0.2;
  const double length_m = (to - from).norm(), step_m = occupancy.resolution_m();
  double blocked_m = 0;
  for (double at_m = kAtStart_m; at_m < length_m - kAtEnd_m; at_m += step_m) {
    const bool is_free = occupancy.IsFree(from + at_m / length_m * (to - from));
    blocked_m = is_free ? 0 : blocked_m + step_m;
    if (blocked_m > kMostBlocked_m) return false;
  }
  return true;
}

struct NearestPoint {
  const DensePoint* point = nullptr;
  double depth_m = std::numeric_limits<double>::infinity();
};

class SightsOfView {
 public:
  SightsOfView(const RigidTransform& T_world_camera, const Camera& camera)
      : T_world_camera_(T_world_camera),
        R_camera_world_(T_world_camera.rotation.conjugate().toRotationMatrix()),
        camera_(camera) {}

  // Points that `hides` does not.
  template <typename Hides>
  Sights Of(const std::vector<DensePoint>& cloud, const OccupancyMap& occupancy,
            const Hides& hides) const {
    const int columns = camera_.width_px / kSightCell_px, rows = camera_.height_px / kSightCell_px;
    std::vector<NearestPoint> cells(static_cast<std::size_t>(columns) * rows);
    for (const DensePoint& point : cloud) {
      const Eigen::Vector3d ray = point.p_world - T_world_camera_.translation;
      if (ray.dot(point.normal_world) > 0) continue;
      const Eigen::Vector3d p = R_camera_world_ * ray;
      if (p.z() < kNearest_m || p.z() > kFarthest_m) continue;
      const Eigen::Vector2d px = PixelFromPlane(camera_, Eigen::Vector2d(p.hnormalized()));
      if (px.x() < 0 || px.y() < 0) continue;
      const int column = static_cast<int>(px.x()) / kSightCell_px;
      const int row = static_cast<int>(px.y()) / kSightCell_px;
      if (column >= columns || row >= rows) continue;
      NearestPoint& cell = cells[row * columns + column];
      if (p.z() < cell.depth_m && !hides(px, p.z())) cell = {&point, p.z()};
    }
    Sights sights;
    sights.p_world_camera = T_world_camera_.translation;
    for (const NearestPoint& cell : cells) {
      if (!cell.point) continue;
      if (!IsFreeWay(occupancy, sights.p_world_camera, cell.point->p_world)) continue;
      sights.p_world.push_back(cell.point->p_world.cast<float>());
      sights.sigma_m.push_back(static_cast<float>(cell.point->sigma_m));
    }
    return sights;
  }

 private:
  const RigidTransform T_world_camera_;
  const Eigen::Matrix3d R_camera_world_;
  const Camera& camera_;
};

}  // namespace

std::vector<Sights> SightsOfCloud(const Trajectory& poses, const Rig& rig,
                                  const std::vector<DensePoint>& cloud, double size_m,
                                  const OccupancyMap& occupancy, const Progress& progress) {
  std::vector<Sights> sights;
  for (std::size_t first = 0; first < poses.size(); first += kViewsAtOnce) {
    progress.ReportOrStop(static_cast<double>(first) / static_cast<double>(poses.size()));
    Views views;
    for (std::size_t i = first; i < std::min(poses.size(), first + kViewsAtOnce); ++i) {
      views.push_back({poses[i].stamp_ns, 0, poses[i].T_world_imu});
    }
    const SightDepths depths(cloud, size_m, ViewCameras(views, rig));
    for (std::size_t i = 0; i < views.size(); ++i) {
      const SightsOfView view(WorldFromCamera(views[i], rig), rig.cameras[0]);
      sights.push_back(view.Of(cloud, occupancy, [&](const Eigen::Vector2d& px, double depth_m) {
        return depths.Hides(static_cast<int>(i), 0, px, depth_m);
      }));
    }
  }
  return sights;
}

}  // namespace slcmap
