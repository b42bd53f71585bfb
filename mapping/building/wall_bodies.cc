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

bool HasOtherFace(const std::vector<WallFace>& walls, const Face& face,
                  const BuildingOptions& options) {
  return std::any_of(walls.begin(), walls.end(), [&](const WallFace& other) {
    return BodyBetween(face, other.face, options) || BodyBetween(other.face, face, options);
  });
}

// As seen from behind the wall; what is along it is in the other order there.
WallFace Opposite(const WallFace& wall, double thickness_m) {
  WallFace back = wall;
  back.face.normal = -wall.face.normal;
  back.face.offset_m = thickness_m - wall.face.offset_m;
  back.face.from_m = -wall.face.to_m;
  back.face.to_m = -wall.face.from_m;
  std::reverse(back.shares.begin(), back.shares.end());
  return back;
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

double TypicalThickness(const std::vector<WallFace>& walls, const BuildingOptions& options) {
  std::vector<std::pair<double, double>> thickness_length_m;
  double all_m = 0;
  for (const WallFace& front : walls) {
    for (const WallFace& back : walls) {
      const auto body = BodyBetween(front.face, back.face, options);
      if (!body) continue;
      thickness_length_m.emplace_back(body->thickness_m, body->to_m - body->from_m);
      all_m += body->to_m - body->from_m;
    }
  }
  std::sort(thickness_length_m.begin(), thickness_length_m.end());
  for (const auto& [thickness_m, length_m] : thickness_length_m) {
    all_m -= 2 * length_m;
    if (all_m <= 0) return thickness_m;
  }
  return options.assumed_thickness_m;
}

std::vector<WallFace> WithUnseenFaces(std::vector<WallFace> walls, const BuildingOptions& options) {
  const double thickness_m = TypicalThickness(walls, options);
  std::vector<WallFace> unseen;
  for (const WallFace& wall : walls) {
    if (!HasOtherFace(walls, wall.face, options)) unseen.push_back(Opposite(wall, thickness_m));
  }
  walls.insert(walls.end(), unseen.begin(), unseen.end());
  return walls;
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
