#include "odometry/frontend/line_selection.h"

#include <algorithm>
#include <cmath>

#include "odometry/frontend/line_geometry.h"

namespace slcmap {
namespace {

constexpr double kMaxAxisAngle_rad = 0.05;
constexpr double kAxisBonus = 2;        // in length
constexpr double kLongEnough_px = 150;  // beyond it more length counts less
constexpr double kNear_px = 12;         // nearly parallel ones so near say the same
constexpr double kNearDiscount = 0.4;
constexpr double kDirectionDiscount = 0.1;  // a line that is there already in this direction
constexpr int kDirectionBins = 6;           // of those that follow no axis

struct Ranked {
  int index = 0;
  int direction = 0;
  double score = 0;
};

// Axes first, then bins of the angle in the image.
int DirectionClass(const LineSegment& s, int axis, int axes) {
  if (axis >= 0) return axis;
  const Eigen::Vector2d d = Direction(s);
  const double turn = std::atan2(d.y(), d.x()) / M_PI + 1;  // 0 to 2; opposite ones are 1 apart
  return axes + static_cast<int>(std::fmod(turn, 1.0) * kDirectionBins);
}

bool IsNear(const LineSegment& a, const LineSegment& b) {
  const double angle = AngleBetween_rad(a, b);
  if (std::min(angle, M_PI - angle) > 0.15 || Overlap_px(a, b) < 0) return false;
  return std::abs(DistanceAcross_px(a, b.Midpoint())) < kNear_px;
}

double SoftLength(double length_px) {
  return length_px < kLongEnough_px ? length_px : std::sqrt(kLongEnough_px * length_px);
}

}  // namespace

int AxisOf(const LineSegment& segment, const Camera& camera,
           const std::vector<Eigen::Vector3d>& axes_camera) {
  const auto ray = [&](const Eigen::Vector2d& p) -> Eigen::Vector3d {
    return {(p.x() - camera.cx_px) / camera.fx_px, (p.y() - camera.cy_px) / camera.fy_px, 1};
  };
  int best = -1;
  double best_angle = kMaxAxisAngle_rad;
  const Eigen::Vector3d middle = ray(segment.Midpoint());
  const Eigen::Vector2d direction = (ray(segment.end) - ray(segment.start)).head<2>().normalized();
  for (size_t i = 0; i < axes_camera.size(); ++i) {
    // The direction in the image, at the segment's middle, of a line along the axis.
    const Eigen::Vector2d v = axes_camera[i].head<2>() - axes_camera[i].z() * middle.head<2>();
    if (v.norm() < 1e-3) continue;
    const double sine = std::abs(v.x() * direction.y() - v.y() * direction.x()) / v.norm();
    if (std::asin(std::min(1.0, sine)) < best_angle) {
      best_angle = std::asin(std::min(1.0, sine));
      best = static_cast<int>(i);
    }
  }
  return best;
}

std::vector<int> SelectSegments(const std::vector<LineSegment>& candidates,
                                const std::vector<LineSegment>& kept, const Camera& camera,
                                const std::vector<Eigen::Vector3d>& axes_camera, int room) {
  const int axes = static_cast<int>(axes_camera.size());
  std::vector<int> in_direction(axes + kDirectionBins + 1, 0);
  for (const auto& s : kept)
    ++in_direction[DirectionClass(s, AxisOf(s, camera, axes_camera), axes)];
  std::vector<Ranked> ranked;
  for (size_t i = 0; i < candidates.size(); ++i) {
    const int axis = AxisOf(candidates[i], camera, axes_camera);
    double score = SoftLength(candidates[i].Length()) * (axis >= 0 ? kAxisBonus : 1);
    for (const auto& s : kept) score *= IsNear(s, candidates[i]) ? kNearDiscount : 1;
    ranked.push_back({static_cast<int>(i), DirectionClass(candidates[i], axis, axes), score});
  }
  const auto worth = [&](const Ranked& r) {
    return r.score / (1 + kDirectionDiscount * in_direction[r.direction]);
  };
  std::vector<int> selected;
  while (static_cast<int>(selected.size()) < room && !ranked.empty()) {
    const auto best = std::max_element(ranked.begin(), ranked.end(),
                                       [&](auto& a, auto& b) { return worth(a) < worth(b); });
    const Ranked chosen = *best;
    ranked.erase(best);
    selected.push_back(chosen.index);
    ++in_direction[chosen.direction];
    for (auto& r : ranked) {
      if (IsNear(candidates[chosen.index], candidates[r.index])) r.score *= kNearDiscount;
    }
  }
  return selected;
}

}  // namespace slcmap
