#include "data/simulator/dots.h"

#include <algorithm>
#include <cmath>

#include "data/simulator/scene/camera_response.h"

namespace slcmap::inline data {
namespace {

// About those of a RealSense D435: some 5,000 dots in 86 by 57 degrees.
constexpr double kHalfWidth = 0.93, kHalfHeight = 0.54;  // tangents
constexpr double kCell = 0.02;                           // a dot each, tangent
constexpr double kDotSigma = 0.0016;                     // of its brightness, tangent
constexpr double kDotRadiance_m2 = 3;                    // at a metre
constexpr double kNearest_m = 0.3;                       // nearer ones are no brighter

// Between 0 and 1, of a cell.
double Drawn(int64_t column, int64_t row, uint32_t which) {
  const auto number = static_cast<uint32_t>(column * 7919 + row * 104729) * 2 + which;
  return UnitFloat(Mixed(number));
}

// What the pattern lights a surface with, that is there in the projector's frame.
double LightAt(const Eigen::Vector3d& p_projector) {
  if (p_projector.z() <= 0) return 0;
  const double u = p_projector.x() / p_projector.z(), v = p_projector.y() / p_projector.z();
  if (std::abs(u) > kHalfWidth || std::abs(v) > kHalfHeight) return 0;
  const double column = std::floor(u / kCell), row = std::floor(v / kCell);
  const auto place = [&](double at, uint32_t which) {
    constexpr double kMargin = 0.25;  // of a cell, so that a dot stays in its own
    const double drawn = Drawn(static_cast<int64_t>(column), static_cast<int64_t>(row), which);
    return (at + kMargin + (1 - 2 * kMargin) * drawn) * kCell;
  };
  const double off = std::hypot(u - place(column, 0), v - place(row, 1)) / kDotSigma;
  if (off > 4) return 0;
  const double distance_m = std::max(kNearest_m, p_projector.norm());
  return kDotRadiance_m2 / (distance_m * distance_m) * std::exp(-0.5 * off * off);
}

}  // namespace

void AddDots(const Rig& rig, int camera, const cv::Mat& depth_m, cv::Mat* radiance) {
  RigidTransform T_imu_projector = rig.T_imu_camera[0];
  T_imu_projector.translation =
      0.5 * (rig.T_imu_camera[0].translation + rig.T_imu_camera[1].translation);
  const auto index = static_cast<size_t>(camera);
  const RigidTransform T_projector_camera = T_imu_projector.Inverse() * rig.T_imu_camera[index];
  for (int y = 0; y < depth_m.rows; ++y) {
    for (int x = 0; x < depth_m.cols; ++x) {
      const double depth = depth_m.at<float>(y, x);
      if (depth <= 0) continue;
      const auto ray = rig.cameras[index].Unproject(Eigen::Vector2d(x, y));
      if (!ray || ray->z() <= 0) continue;
      const double light = LightAt(T_projector_camera * (*ray * (depth / ray->z())));
      radiance->at<float>(y, x) += static_cast<float>(light);
    }
  }
}

}  // namespace slcmap::data
