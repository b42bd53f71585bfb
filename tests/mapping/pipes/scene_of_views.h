// Upright things, seen from views around them.
#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "mapping/map/map.h"
#include "tests/testing/pinhole_camera.h"

namespace slcmap::testing {

inline constexpr double kHalf_m = 1;  // of the height of what is seen
inline constexpr int kViews = 30;

// Upright things about the origin, seen from views at 2 m that look at it.
class SceneOfViews {
 public:
  // The views are within half of turn_rad to either side of the x axis.
  explicit SceneOfViews(double turn_rad) {
    map_.rectified_rig.cameras.assign(2, PinholeCamera(752, 480, 450, 376, 240));
    for (int view = 0; view < kViews; ++view) {
      const double angle_rad = turn_rad * (static_cast<double>(view) / (kViews - 1) - 0.5);
      const Eigen::Vector3d out(std::cos(angle_rad), std::sin(angle_rad), 0);
      Eigen::Matrix3d R;
      R.col(2) = -out;
      R.col(1) = -Eigen::Vector3d::UnitZ();
      R.col(0) = R.col(1).cross(R.col(2));
      map_.keyframes.push_back({view, {Eigen::Quaterniond(R), 2 * out}});
    }
  }

  MapResult& map() { return map_; }
  Eigen::Vector2d Centre(int view) const {
    return map_.keyframes[view].T_world_imu.translation.head<2>();
  }

  int AddLine(const Eigen::Vector2d& place) {
    MapLine line;
    line.id = static_cast<int64_t>(map_.lines.size());
    line.axis = LineAxis::kVertical;
    line.sigma_m = 0.002;
    line.start_world = {place.x(), place.y(), -kHalf_m};
    line.end_world = {place.x(), place.y(), kHalf_m};
    line.kind = LineKind::kEdge;
    map_.lines.push_back(line);
    map_.line_evidence.covariances.push_back({line.id, 0});
    return static_cast<int>(line.id);
  }

  // A view has the line at this place.
  void AddSupport(int line, int view, const Eigen::Vector2d& place) {
    const RigidTransform T_camera_world = map_.keyframes[view].T_world_imu.Inverse();
    const auto pixel = [&](double height_m) -> Eigen::Vector2d {
      const Eigen::Vector3d p = T_camera_world * Eigen::Vector3d(place.x(), place.y(), height_m);
      const Camera& camera = map_.rectified_rig.cameras[0];
      return {camera.fx_px * p.x() / p.z() + camera.cx_px,
              camera.fy_px * p.y() / p.z() + camera.cy_px};
    };
    map_.line_evidence.supports.push_back({line, 0, view, 0, {pixel(-0.9), pixel(0.9)}});
  }

  void AddPoints(const Eigen::Vector2d& place, const Eigen::Vector2d& normal) {
    for (double height_m = -0.95; height_m < 1; height_m += 0.05) {
      map_.dense.push_back(
          {{place.x(), place.y(), height_m}, {normal.x(), normal.y(), 0}, 0.003, 100});
    }
  }

 private:
  MapResult map_;
};

inline Eigen::Vector2d Way(double angle_rad) { return {std::cos(angle_rad), std::sin(angle_rad)}; }

}  // namespace slcmap::testing
