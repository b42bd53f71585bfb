#include "mapping/building/wall_bodies.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace slcmap {
namespace {

constexpr double kOpposite = -0.995;     // cosine, 6 degrees
constexpr double kLeastOverlap_m = 0.3;  // of the faces of a wall
constexpr double kLeastOverlap = 0.5;    // of the shorter one
constexpr double kLeastUnseen_m = 0.8;   // of a wall's back that was not seen, beside what was

bool IsIn(const Face& front, const WallBody& body, const Eigen::Vector2d& p) {
  const double along_m = front.AlongOf(p), behind_m = -front.DistanceTo(p);
  return along_m > body.from_m && along_m < body.to_m && behind_m > 0 &&
         behind_m < body.thickness_m;
}

// As seen from behind the wall; what is along it is in the other order there.
WallFace Opposite(const WallFace& wall, double thickness_m, double thickness_sigma_m) {
  WallFace back = wall;
  back.face.sigma_m = std::hypot(wall.face.sigma_m, thickness_sigma_m);
  back.face.normal = -wall.face.normal;
  back.face.offset_m = thickness_m - wall.face.offset_m;
  back.face.from_m = -wall.face.to_m;
  back.face.to_m = -wall.face.from_m;
  std::reverse(back.shares.begin(), back.shares.end());
  return back;
}

// Steps of a wall as a wall of its own.
WallFace PartOf(const WallFace& wall, size_t first, size_t end) {
  WallFace part = wall;
  part.face.from_m = wall.face.from_m + static_cast<double>(first) * wall.step_m;
  if (end < wall.shares.size()) {
    part.face.to_m = wall.face.from_m + static_cast<double>(end) * wall.step_m;
  }
  part.shares.assign(wall.shares.begin() + static_cast<int64_t>(first),
                     wall.shares.begin() + static_cast<int64_t>(end));
  return part;
}

// Where none of its bodies has a face behind it, but for stretches as short as the end of a wall
// that meets it.
std::vector<WallFace> PartsWithoutBack(const WallFace& wall, const std::vector<WallBody>& bodies) {
  const auto has_back = [&](size_t step) {
    const double along_m = wall.face.from_m + (static_cast<double>(step) + 0.5) * wall.step_m;
    return std::any_of(bodies.begin(), bodies.end(), [&](const WallBody& body) {
      return along_m > body.from_m && along_m < body.to_m;
    });
  };
  std::vector<WallFace> parts;
  for (size_t first = 0; first < wall.shares.size();) {
    size_t end = first;
    while (end < wall.shares.size() && has_back(end) == has_back(first)) ++end;
    const double length_m = static_cast<double>(end - first) * wall.step_m;
    if (!has_back(first) && (length_m >= kLeastUnseen_m || bodies.empty())) {
      parts.push_back(PartOf(wall, first, end));
    }
    first = end;
  }
  return parts;
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

std::vector<WallBody> BodiesOf(const std::vector<WallFace>& walls, const BuildingOptions& options) {
  std::vector<WallBody> bodies;
  for (size_t front = 0; front < walls.size(); ++front) {
    for (size_t back = 0; back < walls.size(); ++back) {
      auto body = BodyBetween(walls[front].face, walls[back].face, options);
      if (!body) continue;
      body->front = front;
      body->back = back;
      bodies.push_back(*body);
    }
  }
  return bodies;
}

double TypicalThickness(std::vector<WallBody> bodies, const BuildingOptions& options) {
  std::sort(bodies.begin(), bodies.end(),
            [](const WallBody& a, const WallBody& b) { return a.thickness_m < b.thickness_m; });
  double left_m = 0;
  for (const WallBody& body : bodies) left_m += body.to_m - body.from_m;
  for (const WallBody& body : bodies) {
    left_m -= 2 * (body.to_m - body.from_m);
    if (left_m <= 0) return body.thickness_m;
  }
  return options.assumed_thickness_m;
}

std::vector<WallFace> UnseenFaces(const std::vector<WallFace>& walls,
                                  const BuildingOptions& options) {
  constexpr double kOwnSigma_m = 0.01, kOthersSigma_m = 0.03, kAssumedSigma_m = 0.06;
  const std::vector<WallBody> bodies = BodiesOf(walls, options);
  const double typical_m = TypicalThickness(bodies, options);
  const double typical_sigma_m = bodies.empty() ? kAssumedSigma_m : kOthersSigma_m;
  std::vector<WallFace> unseen;
  for (size_t i = 0; i < walls.size(); ++i) {
    std::vector<WallBody> own;
    std::copy_if(bodies.begin(), bodies.end(), std::back_inserter(own),
                 [&](const WallBody& body) { return body.front == i; });
    const double thickness_m = own.empty() ? typical_m : TypicalThickness(own, options);
    const double sigma_m = own.empty() ? typical_sigma_m : kOwnSigma_m;
    for (const WallFace& part : PartsWithoutBack(walls[i], own)) {
      unseen.push_back(Opposite(part, thickness_m, sigma_m));
    }
  }
  return unseen;
}

bool IsInWall(const std::vector<WallFace>& walls, const std::vector<WallBody>& bodies,
              const Eigen::Vector2d& p) {
  return std::any_of(bodies.begin(), bodies.end(),
                     [&](const WallBody& body) { return IsIn(walls[body.front].face, body, p); });
}

}  // namespace slcmap
