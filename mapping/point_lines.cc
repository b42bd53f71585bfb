#include "mapping/point_lines.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mapping/point_index.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr double kMost_m = 0.04, kSigmas = 3;
constexpr double kLeastOff_m = 0.002;  // of anything that images tell

double DistanceTo(const MapLine& line, const Vector3d& p) {
  const Vector3d way = line.end_world - line.start_world;
  const double squared_m2 = way.squaredNorm();
  const double share =
      squared_m2 > 0 ? std::clamp(way.dot(p - line.start_world) / squared_m2, 0.0, 1.0) : 0;
  return (line.start_world + share * way - p).norm();
}

double Reach(const MapLine& line, const MapPoint& point) {
  return std::min(kMost_m, kSigmas * std::hypot(line.sigma_m, point.sigma_m, kLeastOff_m));
}

}  // namespace

void FindLinesOfPoints(const std::vector<MapLine>& lines, std::vector<MapPoint>* points) {
  constexpr double kStep_m = 0.05;
  const double near_m = std::hypot(kMost_m, kStep_m / 2);  // of the nearest step
  PointIndex index(near_m);
  for (size_t i = 0; i < points->size(); ++i) {
    (*points)[i].line_id = -1;
    index.Add((*points)[i].p_world, i);
  }
  std::vector<double> nearest_m(points->size(), std::numeric_limits<double>::infinity());
  for (const MapLine& line : lines) {
    const Vector3d way = line.end_world - line.start_world;
    const int steps = 1 + static_cast<int>(way.norm() / kStep_m);
    for (int step = 0; step <= steps; ++step) {
      index.AnyNear(line.start_world + step * way / steps, near_m, [&](size_t i) {
        MapPoint& point = (*points)[i];
        const double distance_m = DistanceTo(line, point.p_world);
        if (distance_m <= Reach(line, point) && distance_m < nearest_m[i]) {
          nearest_m[i] = distance_m;
          point.line_id = line.id;
        }
        return false;  // on to the next
      });
    }
  }
}

}  // namespace slcmap
