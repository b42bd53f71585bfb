#include "mapping/building/wall_bodies.h"

#include <algorithm>

namespace slcmap {
namespace {

constexpr double kOpposite = -0.995;     // cosine, 6 degrees
constexpr double kLeastOverlap_m = 0.3;  // of the faces of a wall
constexpr double kLeastOverlap = 0.5;    // of the shorter one

bool IsIn(const Face& front, const WallBody& body, const Eigen::Vector2d& p) {
  const double along_m = front.AlongOf(p), behind_m = -front.DistanceTo(p);
  return along_m > body.from_m && along_m < body.to_m && behind_m > 0 &&
         behind_m < body.thickness_m;
}

}  // namespace

std::optional<WallBody> BodyBetween(const Face& front, const Face& back,
                                    const BuildingOptions& options) {
  if (front.level != back.level || front.normal.dot(back.normal) > kOpposite) return std::nullopt;
  const double a = front.AlongOf(back.PointAt(back.from_m));
  const double b = front.AlongOf(back.PointAt(back.to_m));
  WallBody body;
  body.from_m = std::max(front.from_m, std::min(a, b));
  body.to_m = std::min(front.to_m, std::max(a, b));
  const double least_m =
      std::max(kLeastOverlap_m, kLeastOverlap * std::min(front.Length(), back.Length()));
  if (body.to_m - body.from_m < least_m) return std::nullopt;
  body.thickness_m = -back.DistanceTo(front.PointAt(0.5 * (body.from_m + body.to_m)));
  // Before the back is behind the front.
  const bool fits =
      body.thickness_m >= options.min_thickness_m && body.thickness_m <= options.max_thickness_m;
  return fits ? std::optional(body) : std::nullopt;
}

bool IsInWall(const std::vector<WallFace>& walls, const Eigen::Vector2d& p,
              const BuildingOptions& options) {
  for (const WallFace& front : walls) {
    for (const WallFace& back : walls) {
      const auto body = BodyBetween(front.face, back.face, options);
      if (body && IsIn(front.face, *body, p)) return true;
    }
  }
  return false;
}

}  // namespace slcmap
