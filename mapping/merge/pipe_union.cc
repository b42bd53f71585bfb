#include "mapping/merge/pipe_union.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "data/line_angle.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr double kOneAxis_rad = 3 * std::numbers::pi / 180;
constexpr double kSameName_rad = std::numbers::pi / 180;
constexpr double kOneAxis_m = 0.02;       // across, or as much of the radius as follows
constexpr double kOneRadiusShare = 0.25;  // by which radii, and axes, of one pipe may differ
constexpr double kGap_m = 0.3;            // along a pipe, between what both saw of it

Vector3d DirectionOf(const MapPipe& pipe) {
  return (pipe.end_world - pipe.start_world).normalized();
}

bool IsOnePipe(const MapPipe& a, const MapPipe& b) {
  const Vector3d direction = DirectionOf(a);
  if (LineAngle_rad(direction, DirectionOf(b)) > kOneAxis_rad) return false;
  const double radius_m = std::max(a.radius_m, b.radius_m);
  if (std::abs(a.radius_m - b.radius_m) > kOneRadiusShare * radius_m) return false;
  const Vector3d way = 0.5 * (b.start_world + b.end_world) - 0.5 * (a.start_world + a.end_world);
  const double along_m = way.dot(direction);
  const double lengths_m =
      (a.end_world - a.start_world).norm() + (b.end_world - b.start_world).norm();
  return (way - along_m * direction).norm() <= std::max(kOneAxis_m, kOneRadiusShare * radius_m) &&
         std::abs(along_m) <= 0.5 * lengths_m + kGap_m;
}

MapPipe United(const MapPipe& a, const MapPipe& b) {
  MapPipe best = b.sigma_m < a.sigma_m ? b : a;
  best.axis = a.axis;  // has its name already
  best.world = a.world;
  best.images = a.images + b.images;
  const Vector3d from = best.start_world, direction = DirectionOf(best);
  double least_m = 0, most_m = 0;
  for (const Vector3d& p : {a.start_world, a.end_world, b.start_world, b.end_world}) {
    const double along_m = direction.dot(p - from);
    least_m = std::min(least_m, along_m);
    most_m = std::max(most_m, along_m);
  }
  best.start_world = from + least_m * direction;
  best.end_world = from + most_m * direction;
  return best;
}

void NameAxis(const std::vector<MapLine>& lines, MapPipe* pipe) {
  const auto is_along = [&](const MapLine& line) {
    return line.axis != LineAxis::kNone &&
           LineAngle_rad(line.end_world - line.start_world, DirectionOf(*pipe)) < kSameName_rad;
  };
  const auto found = std::find_if(lines.begin(), lines.end(), is_along);
  const bool is_named = pipe->axis != LineAxis::kNone && found != lines.end();
  pipe->axis = is_named ? found->axis : LineAxis::kNone;
  pipe->world = is_named ? found->world : -1;
}

}  // namespace

std::vector<MapPipe> UnitePipes(std::vector<MapPipe> first, const std::vector<MapPipe>& second,
                                const std::vector<MapLine>& lines) {
  for (MapPipe pipe : second) {
    NameAxis(lines, &pipe);
    // What has grown may reach another piece of the same pipe.
    for (auto known = first.begin(); known != first.end();) {
      if (!IsOnePipe(*known, pipe)) {
        ++known;
        continue;
      }
      pipe = United(*known, pipe);
      first.erase(known);
      known = first.begin();
    }
    first.push_back(pipe);
  }
  for (size_t i = 0; i < first.size(); ++i) {
    first[i].id = static_cast<int64_t>(i);
    first[i].segment = 0;
  }
  return first;
}

}  // namespace slcmap
