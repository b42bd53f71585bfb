#include "odometry/frontend/line_geometry.h"

#include <algorithm>
#include <cmath>

namespace slcmap {

Eigen::Vector2d Direction(const LineSegment& segment) {
  return (segment.end - segment.start).normalized();
}

Eigen::Vector2d Normal(const LineSegment& segment) {
  const Eigen::Vector2d d = Direction(segment);
  return {d.y(), -d.x()};
}

LineSegment Reversed(const LineSegment& segment) { return {segment.end, segment.start}; }

double AngleBetween_rad(const LineSegment& a, const LineSegment& b) {
  const Eigen::Vector2d p = Direction(a), q = Direction(b);
  return std::atan2(std::abs(p.x() * q.y() - p.y() * q.x()), p.dot(q));
}

double DistanceAcross_px(const LineSegment& line, const Eigen::Vector2d& point_px) {
  return Normal(line).dot(point_px - line.start);
}

double PlaceAlong_px(const LineSegment& line, const Eigen::Vector2d& point_px) {
  return Direction(line).dot(point_px - line.start);
}

double Overlap_px(const LineSegment& a, const LineSegment& b) {
  const double s = PlaceAlong_px(a, b.start), e = PlaceAlong_px(a, b.end);
  return std::min(a.Length(), std::max(s, e)) - std::max(0.0, std::min(s, e));
}

double LargestDistance_px(const LineSegment& a, const LineSegment& b) {
  const double s = PlaceAlong_px(a, b.start), e = PlaceAlong_px(a, b.end);
  const double ds = DistanceAcross_px(a, b.start), de = DistanceAcross_px(a, b.end);
  if (std::abs(e - s) < 1e-9) return std::max(std::abs(ds), std::abs(de));
  const auto distance_at = [&](double along) {
    const double clamped = std::clamp(along, std::min(s, e), std::max(s, e));
    return std::abs(ds + (de - ds) * (clamped - s) / (e - s));
  };
  const double low = std::clamp(std::min(s, e), 0.0, a.Length());
  const double high = std::clamp(std::max(s, e), 0.0, a.Length());
  return std::max(distance_at(low), distance_at(high));
}

}  // namespace slcmap
