#include "odometry/window/window_state.h"

#include <algorithm>
#include <utility>

namespace slcmap {

ImuCut CutOf(const ImuBuffer& imu, int64_t stamp_ns, int64_t offset_ns) {
  constexpr int64_t kAveraged_ns = 20'000'000;
  return {offset_ns, imu.MeanRate(stamp_ns + offset_ns, kAveraged_ns)};
}

std::vector<LineLandmark*> LinesOf(const PointLandmark& landmark, WindowState* window) {
  std::vector<LineLandmark*> lines;
  for (auto& [id, line] : window->lines) {
    if (!line.estimated || line.retired || !line.IsStructural()) continue;
    if (std::find(line.points.begin(), line.points.end(), landmark.id) != line.points.end()) {
      lines.push_back(&line);
    }
  }
  return lines;
}

Eigen::Vector3d LandmarkInWorld(const PointLandmark& landmark, const StereoGeometry& geometry) {
  const Eigen::Vector3d p_camera =
      Eigen::Vector3d(landmark.point[0], landmark.point[1], 1) / landmark.inverse_depth_per_m();
  return landmark.host()->T_world_imu() * (geometry.T_imu_camera[0] * p_camera);
}

void LineExtent::Add(double from_m, double to_m) {
  if (from_m < from_m_[0]) std::swap(from_m_[0], from_m);
  from_m_[1] = std::min(from_m_[1], from_m);
  if (to_m > to_m_[0]) std::swap(to_m_[0], to_m);
  to_m_[1] = std::max(to_m_[1], to_m);
}

void LineExtent::Add(const LineExtent& other, double along_m) {
  for (size_t i = 0; i < 2; ++i) Add(other.from_m_[i] + along_m, other.to_m_[i] + along_m);
}

PointAndDirection LineLandmark::InWorld() const {
  if (!IsExact()) return GeneralLineFromBlock(anchor_world, block.data());
  return {CrossingPoint(structural(), heading_rad(), block.data()),
          AxisDirection(axis, heading_rad())};
}

Eigen::Vector3d LineLandmark::AxisInWorld() const {
  return slope ? SlopeDirection(slope->angles_rad.data()) : AxisDirection(axis, heading_rad());
}

Matrix32d LineLandmark::AcrossAxisInWorld() const {
  return slope ? AxesAcrossSlope(slope->angles_rad.data()) : AxesAcross(axis, heading_rad());
}

std::vector<std::optional<double>> HeadingsOf(const WindowState& window) {
  std::vector<std::optional<double>> headings;
  for (const HeadingState& heading : window.headings) {
    headings.push_back(heading.withdrawn ? std::nullopt : std::optional(heading.heading_rad[0]));
  }
  return headings;
}

}  // namespace slcmap
