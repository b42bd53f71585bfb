#include "mapping/building/wall_lines.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;

// Rooms.
constexpr double kExtension_m = 30;  // of a wall's line beyond what was measured of it, at most

constexpr double kCovered = 0.4;  // share of a step from which on it counts as covered
constexpr double kReach_m = 0.3;  // from where another wall ends at it to what was measured of it

// The parts of a face between its ends, by whether they are covered.
std::vector<WallPart> SplitIntoParts(const WallFace& wall) {
  std::vector<WallPart> parts;
  for (size_t i = 0; i < wall.shares.size(); ++i) {
    const bool covered = wall.shares[i] >= kCovered;
    const double from_m = wall.face.from_m + static_cast<double>(i) * wall.step_m;
    const double to_m = std::min(from_m + wall.step_m, wall.face.to_m);
    if (parts.empty() || (parts.back().share > 0) != covered) {
      parts.push_back({from_m, to_m, covered ? 1.0 : 0.0});
    } else {
      parts.back().to_m = to_m;
    }
  }
  return parts;
}

// Whether a wall is covered somewhere between two places along it.
bool IsCoveredBetween(const WallFace& wall, double low_m, double high_m) {
  const auto step_of = [&](double at_m) {
    return static_cast<int64_t>(std::floor((at_m - wall.face.from_m) / wall.step_m));
  };
  const auto count = static_cast<int64_t>(wall.shares.size());
  const int64_t last = std::min(step_of(high_m), count - 1);
  for (int64_t step = std::max<int64_t>(0, step_of(low_m)); step <= last; ++step) {
    if (wall.shares[step] >= kCovered) return true;
  }
  return false;
}

bool IsCoveredNear(const WallFace& wall, double along_m) {
  return IsCoveredBetween(wall, along_m - kReach_m, along_m + kReach_m);
}

// A wall that goes on at both sides, other than one that ends there.
bool IsCoveredAcross(const WallFace& wall, double along_m) {
  return IsCoveredBetween(wall, along_m - kReach_m, along_m - kReach_m / 2) &&
         IsCoveredBetween(wall, along_m + kReach_m / 2, along_m + kReach_m);
}

// How far beyond an end of a face the first other wall is of those that stand in its way; nothing
// within `most_m`.
template <typename Stands>
std::optional<double> FirstWall(const std::vector<WallFace>& walls, const WallFace& wall,
                                bool at_end, double most_m, Stands stands) {
  std::optional<double> first_m;
  for (const WallFace& other : walls) {
    const auto crossing = Crossing(wall.face, other.face);
    if (!crossing || !stands(other, crossing->second)) continue;
    const double beyond_m =
        at_end ? crossing->first - wall.face.to_m : wall.face.from_m - crossing->first;
    if (beyond_m < -kReach_m || beyond_m > most_m) continue;
    if (!first_m || beyond_m < *first_m) first_m = beyond_m;
  }
  return first_m;
}

// Beyond both faces of another wall, where that was measured, no line goes on.
double FindExtension(const std::vector<WallFace>& walls, const WallFace& wall, bool at_end,
                     const BuildingOptions& options) {
  const auto first_m = FirstWall(walls, wall, at_end, kExtension_m, IsCoveredAcross);
  return first_m ? std::max(*first_m, 0.0) + options.max_thickness_m : kExtension_m;
}

void Extend(const std::vector<WallFace>& walls, const BuildingOptions& options, WallLine* line) {
  const WallFace& wall = *line->wall;
  const double far_from_m = wall.face.from_m - FindExtension(walls, wall, false, options);
  const double far_to_m = wall.face.to_m + FindExtension(walls, wall, true, options);
  const auto before_m = FirstWall(walls, wall, false, options.max_door_width_m, IsCoveredNear);
  const auto after_m = FirstWall(walls, wall, true, options.max_door_width_m, IsCoveredNear);
  const double from_m = wall.face.from_m - std::max(before_m.value_or(0), 0.0);
  const double to_m = wall.face.to_m + std::max(after_m.value_or(0), 0.0);
  std::vector<WallPart> parts;
  if (from_m > far_from_m) parts.push_back({far_from_m, from_m});
  if (from_m < wall.face.from_m) parts.push_back({from_m, wall.face.from_m, 0, true});
  parts.insert(parts.end(), line->parts.begin(), line->parts.end());
  if (to_m > wall.face.to_m) parts.push_back({wall.face.to_m, to_m, 0, true});
  if (to_m < far_to_m) parts.push_back({to_m, far_to_m});
  line->parts = parts;
}

}  // namespace

PlanPoints WallLine::Chain() const {
  PlanPoints chain;
  for (const WallPart& part : parts) chain.push_back(wall->face.PointAt(part.from_m));
  chain.push_back(wall->face.PointAt(parts.back().to_m));
  return chain;
}

std::optional<std::pair<double, double>> Crossing(const Face& a, const Face& b) {
  constexpr double kLeastSine = 0.2;
  Eigen::Matrix2d normals;
  normals << a.normal.transpose(), b.normal.transpose();
  if (std::abs(normals.determinant()) < kLeastSine) return std::nullopt;
  const Vector2d point = normals.inverse() * Vector2d(a.offset_m, b.offset_m);
  return std::pair(a.MeasureAlong(point), b.MeasureAlong(point));
}

std::vector<WallLine> CollectLines(const std::vector<WallFace>& walls,
                                   const BuildingOptions& options) {
  std::vector<WallLine> lines;
  for (const WallFace& wall : walls) {
    WallLine line{&wall, SplitIntoParts(wall)};
    for (size_t i = 1; i + 1 < line.parts.size(); ++i) {
      WallPart& part = line.parts[i];
      part.is_narrow = part.share == 0 && part.to_m - part.from_m <= options.max_door_width_m;
    }
    Extend(walls, options, &line);
    lines.push_back(line);
  }
  return lines;
}

std::optional<WallPart> PartAt(const std::vector<WallLine>& lines, const Vector2d& a,
                               const Vector2d& b) {
  std::optional<WallPart> best;
  const Vector2d middle = 0.5 * (a + b);
  for (const WallLine& line : lines) {
    const Face& face = line.wall->face;
    // Points on the grid are that far from their line, or a little more where it was bent to them.
    if (std::abs(face.DistanceTo(middle)) > 4 * kPlanGrid_m) continue;
    if (std::abs(face.normal.dot((b - a).normalized())) > 0.05) continue;
    const double along_m = face.MeasureAlong(middle);
    for (const WallPart& part : line.parts) {
      if (along_m < part.from_m || along_m > part.to_m) continue;
      if (best && part.share <= best->share && !(part.is_narrow && best->share == 0)) {
        continue;
      }
      best = part;
    }
  }
  return best;
}

namespace {

constexpr double kOpposite = -0.995;     // cosine, 6 degrees
constexpr double kLeastOverlap_m = 0.3;  // of the faces of a wall
constexpr double kLeastOverlap = 0.5;    // of the shorter one
constexpr double kLeastUnseen_m = 0.8;   // of a wall's back that was not seen, beside what was

bool IsIn(const Face& front, const WallBody& body, const Eigen::Vector2d& p) {
  const double along_m = front.MeasureAlong(p), behind_m = -front.DistanceTo(p);
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
WallFace MakePart(const WallFace& wall, size_t first, size_t end) {
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
      parts.push_back(MakePart(wall, first, end));
    }
    first = end;
  }
  return parts;
}

}  // namespace

std::optional<WallBody> BodyBetween(const Face& front, const Face& back,
                                    const BuildingOptions& options) {
  if (front.level != back.level || front.normal.dot(back.normal) > kOpposite) return std::nullopt;
  const double a = front.MeasureAlong(back.PointAt(back.from_m));
  const double b = front.MeasureAlong(back.PointAt(back.to_m));
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

std::vector<WallBody> MakeBodies(const std::vector<WallFace>& walls,
                                 const BuildingOptions& options) {
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
  const std::vector<WallBody> bodies = MakeBodies(walls, options);
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

}  // namespace slcmap::mapping
