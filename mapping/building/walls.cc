#include "mapping/building/walls.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <tuple>

#include "mapping/building/wall_lines.h"

namespace slcmap::inline mapping {
namespace {

constexpr double kToCorner_m = 0.5;    // from a measured end to the corner
constexpr double kAlike = 0.99;        // cosine, 8 degrees
constexpr double kLong_m = 1.5;        // covered: of a wall that need not be like others
constexpr double kThin_m = 0.25;       // between two faces that make a wall of each other
constexpr double kSure = 0.5;          // share of a shorter one that must reach the top
constexpr double kRight = 0.995;       // cosine, 6 degrees
constexpr double kBeside_m = 0.4;      // behind or before a wall there is no other
constexpr double kMostAbove_m = 0.75;  // the floor, what is measured of a wall may begin

double FindCorner(const std::vector<BuiltFace>& faces, const BuiltFace& built, double end_m) {
  const Face& face = built.wall.face;
  double corner_m = end_m, least_m = kToCorner_m;
  for (const BuiltFace& other : faces) {
    if (!other.is_wall || &other == &built || other.wall.face.level != face.level) continue;
    const auto crossing = Crossing(face, other.wall.face);
    if (!crossing || crossing->second < other.wall.face.from_m - kToCorner_m ||
        crossing->second > other.wall.face.to_m + kToCorner_m) {
      continue;
    }
    const double distance_m = std::abs(crossing->first - end_m);
    if (distance_m >= least_m) continue;
    least_m = distance_m;
    corner_m = crossing->first;
  }
  return corner_m;
}

PlanOpening MakeOpening(const Face& front, const FaceOpening& opening, const Face& face,
                        const Level& level) {
  const double a = front.MeasureAlong(face.PointAt(opening.from_m));
  const double b = front.MeasureAlong(face.PointAt(opening.to_m));
  return {opening.kind,
          opening.walked,
          std::min(a, b) - front.from_m,
          std::max(a, b) - front.from_m,
          std::max(0.0, opening.low_m - level.floor_m),
          opening.high_m - opening.low_m};
}

// One that both sides show is as wide as the mean of both.
void AddOpening(const PlanOpening& opening, std::vector<PlanOpening>* openings) {
  for (PlanOpening& known : *openings) {
    const double overlap_m =
        std::min(known.to_m, opening.to_m) - std::max(known.from_m, opening.from_m);
    if (overlap_m < 0.5 * (opening.to_m - opening.from_m)) continue;
    known.from_m = 0.5 * (known.from_m + opening.from_m);
    known.to_m = 0.5 * (known.to_m + opening.to_m);
    known.walked = known.walked || opening.walked;
    if (opening.kind == OpeningKind::kDoor) known.kind = opening.kind;
    return;
  }
  openings->push_back(opening);
}

// Planes behind a wall that nobody saw, and that no other wall has.
void TakeInferred(const std::vector<BuiltFace>& faces, const Face& front,
                  const BuildingOptions& options, std::vector<bool>* is_taken, PlanWall* wall) {
  for (size_t i = 0; i < faces.size(); ++i) {
    if ((*is_taken)[i] || !faces[i].is_inferred) continue;
    if (!BodyBetween(front, faces[i].wall.face, options)) continue;
    (*is_taken)[i] = true;
    wall->plane_ids.push_back(faces[i].plane_id);
  }
}

// Of the part of a wall between two places along it.
double CoveredLength(const WallFace& wall, const Interval& part) {
  double covered_m = 0;
  for (size_t i = 0; i < wall.shares.size(); ++i) {
    const double at_m = wall.face.from_m + (static_cast<double>(i) + 0.5) * wall.step_m;
    if (wall.shares[i] > 0 && at_m > part.from_m && at_m < part.to_m) covered_m += wall.step_m;
  }
  return covered_m;
}

// The step of a wall that is at a place in the plan; nothing beyond its ends.
std::optional<size_t> FindStep(const WallFace& wall, const Eigen::Vector2d& p) {
  const double at = (wall.face.MeasureAlong(p) - wall.face.from_m) / wall.step_m;
  if (at < 0 || at >= static_cast<double>(wall.shares.size())) return std::nullopt;
  return static_cast<size_t>(at);
}

Eigen::Vector2d FindMiddle(const WallFace& wall, size_t step) {
  return wall.face.PointAt(wall.face.from_m + (static_cast<double>(step) + 0.5) * wall.step_m);
}

// Takes a wall's shares where a stronger one stands beside it, or looks at it from so near that no
// camera was between them.
void ClearSharesBeside(const WallFace& stronger, WallFace* weaker) {
  const double cosine = stronger.face.normal.dot(weaker->face.normal);
  if (stronger.face.level != weaker->face.level || std::abs(cosine) < kAlike) return;
  for (size_t i = 0; i < weaker->shares.size(); ++i) {
    const Eigen::Vector2d p = FindMiddle(*weaker, i);
    const double before_m = stronger.face.DistanceTo(p);
    if (before_m > kBeside_m || before_m < (cosine > 0 ? -kBeside_m : 0)) continue;
    const auto step = FindStep(stronger, p);
    if (step && stronger.shares[*step] > 0) weaker->shares[i] = 0;
  }
}

// Whether a wall looks the same way as a face, just behind it at a place in the plan, as the wall
// of a niche does. What is nearer than this is not seen apart by rays.
bool IsJustBehind(const Face& face, const WallFace& wall, const Eigen::Vector2d& place) {
  constexpr double kLeast_m = 0.15;
  const double behind_m = wall.face.DistanceTo(place) - face.DistanceTo(place);
  return face.level == wall.face.level && face.normal.dot(wall.face.normal) >= kAlike &&
         behind_m >= kLeast_m && behind_m <= kBeside_m && FindStep(wall, place);
}

// Whether something stands in enough places of it, and nearly from the floor on: the reveals of
// windows begin at their sills.
bool StandsOnFloor(const WallFace& wall, double floor_m) {
  return IsWall(wall.shares, wall.step_m) && wall.face.mostly_above_m <= floor_m + kMostAbove_m;
}

// Whether it stands from floor to top in enough places to hide what is behind it, as a pier does.
bool IsPier(const WallFace& wall, double floor_m) {
  const std::vector<double> solid(wall.is_solid.begin(), wall.is_solid.end());
  return IsWall(solid, wall.step_m) && StandsOnFloor(wall, floor_m);
}

// Takes a wall's shares where a pier hides it.
void ClearSharesBehind(const WallFace& pier, WallFace* back) {
  for (size_t i = 0; i < back->shares.size(); ++i) {
    const Eigen::Vector2d p = FindMiddle(*back, i);
    const auto step = FindStep(pier, p);
    if (step && pier.is_solid[*step] && IsJustBehind(pier.face, *back, p)) back->shares[i] = 0;
  }
}

bool IsLong(const BuiltFace& built) {
  const Face& face = built.wall.face;
  return CoveredLength(built.wall, {face.from_m, face.to_m}) >= kLong_m;
}

// Whether a wall ends at a passage: without a lintel, what stands beyond it in the wall's plane is
// the jamb of a door across, or the like.
bool EndsAt(const WallFace& wall, const FaceOpening& opening, double top_m) {
  const Face& face = wall.face;
  return opening.IsGap(top_m) &&
         (CoveredLength(wall, {face.from_m, opening.from_m}) < kToCorner_m ||
          CoveredLength(wall, {opening.to_m, face.to_m}) < kToCorner_m);
}

// Whether another face is right behind it, as the other side of a wall is; a door's leaf is
// thinner.
bool HasBack(const std::vector<BuiltFace>& faces, const WallFace& wall, double floor_m) {
  return std::ranges::any_of(faces, [&](const BuiltFace& other) {
    const auto body = BodyBetween(wall.face, other.wall.face, {});
    return body && body->thickness_m <= kThin_m && StandsOnFloor(other.wall, floor_m);
  });
}

// Normals at corners, reveals and furniture point anywhere, and a door's leaf is as high as can be
// seen of it: what is short is a wall only where its other side was seen, or where it reaches the
// top, along or across a long one.
bool IsMeasuredWall(const std::vector<BuiltFace>& faces, const BuiltFace& built, double floor_m) {
  if (IsLong(built)) return true;
  if (!StandsOnFloor(built.wall, floor_m)) return false;
  if (HasBack(faces, built.wall, floor_m)) return true;
  const std::vector<double>& shares = built.wall.shares;
  const auto sure = std::count(shares.begin(), shares.end(), 1.0);
  if (static_cast<double>(sure) < kSure * static_cast<double>(shares.size())) return false;
  return std::any_of(faces.begin(), faces.end(), [&](const BuiltFace& other) {
    const double cosine = std::abs(other.wall.face.normal.dot(built.wall.face.normal));
    return other.is_wall && IsLong(other) && other.wall.face.level == built.wall.face.level &&
           (cosine > kRight || cosine < std::sqrt(1 - kRight * kRight));
  });
}

// The faces of walls that were measured, the longest first.
std::vector<size_t> MeasuredByLength(const std::vector<BuiltFace>& faces) {
  std::vector<size_t> order;
  for (size_t i = 0; i < faces.size(); ++i) {
    if (faces[i].is_wall && !faces[i].is_inferred) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return faces[a].wall.face.Length() > faces[b].wall.face.Length();
  });
  return order;
}

PlanWall WallAlong(const BuiltFace& built, const Level& level) {
  const Face& front = built.wall.face;
  PlanWall wall;
  wall.storey = front.level;
  wall.start = front.PointAt(front.from_m);
  wall.end = front.PointAt(front.to_m);
  wall.sigma_m = front.sigma_m;
  wall.plane_ids.push_back(built.plane_id);
  for (const FaceOpening& opening : built.openings) {
    AddOpening(MakeOpening(front, opening, front, level), &wall.openings);
  }
  return wall;
}

// Takes the faces behind the front, which tell the wall's thickness too.
void TakeBacks(const std::vector<BuiltFace>& faces, const std::vector<size_t>& order,
               const Face& front, const Level& level, const BuildingOptions& options,
               std::vector<bool>* is_taken, PlanWall* wall) {
  double thickness_m2 = 0, overlap_m = 0;
  for (const size_t i : order) {
    if ((*is_taken)[i]) continue;
    const Face& back = faces[i].wall.face;
    const auto body = BodyBetween(front, back, options);
    if (!body) continue;
    (*is_taken)[i] = true;
    thickness_m2 += (body->to_m - body->from_m) * body->thickness_m;
    overlap_m += body->to_m - body->from_m;
    wall->plane_ids.push_back(faces[i].plane_id);
    for (const FaceOpening& opening : faces[i].openings) {
      AddOpening(MakeOpening(front, opening, back, level), &wall->openings);
    }
  }
  wall->thickness_assumed = overlap_m == 0;
  if (overlap_m > 0) wall->thickness_m = thickness_m2 / overlap_m;
}

// The part of a wall along a stretch of it.
BuiltFace CutToStretch(BuiltFace built, const Interval& stretch) {
  WallFace& wall = built.wall;
  const auto step_at = [&](double along_m) {
    const double step = std::round((along_m - wall.face.from_m) / wall.step_m);
    return static_cast<std::ptrdiff_t>(
        std::clamp(step, 0.0, static_cast<double>(wall.shares.size())));
  };
  wall.shares = {wall.shares.begin() + step_at(stretch.from_m),
                 wall.shares.begin() + step_at(stretch.to_m)};
  wall.is_solid.clear();
  wall.face.from_m = stretch.from_m;
  wall.face.to_m = stretch.to_m;
  std::erase_if(built.openings, [&](const FaceOpening& opening) {
    return opening.from_m < stretch.from_m || opening.to_m > stretch.to_m;
  });
  return built;
}

}  // namespace

void SelectWalls(const Level& level, std::vector<BuiltFace>* faces) {
  std::vector<size_t> order(faces->size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return (*faces)[a].wall.measured_m > (*faces)[b].wall.measured_m;
  });
  for (const BuiltFace& front : *faces) {
    if (!IsPier(front.wall, level.floor_m)) continue;
    for (BuiltFace& back : *faces) ClearSharesBehind(front.wall, &back.wall);
  }
  for (size_t i = 0; i < order.size(); ++i) {
    BuiltFace& built = (*faces)[order[i]];
    for (size_t k = 0; k < i; ++k) ClearSharesBeside((*faces)[order[k]].wall, &built.wall);
    built.is_wall = IsWall(built.wall.shares, built.wall.step_m) &&
                    IsMeasuredWall(*faces, built, level.floor_m);
  }
}

void CutAtGaps(const Level& level, std::vector<BuiltFace>* faces) {
  std::vector<BuiltFace> cut;
  for (const BuiltFace& built : *faces) {
    const Face& face = built.wall.face;
    const auto is_niche = [&](const FaceOpening& opening) {
      const Eigen::Vector2d middle = face.PointAt(0.5 * (opening.from_m + opening.to_m));
      return !opening.walked && std::ranges::any_of(*faces, [&](const BuiltFace& other) {
        return other.is_wall && IsJustBehind(face, other.wall, middle) &&
               other.wall.shares[*FindStep(other.wall, middle)] > 0;
      });
    };
    std::vector<Interval> stretches = {{face.from_m, face.to_m}};
    for (const FaceOpening& opening : built.openings) {  // by where they begin
      if (!is_niche(opening) && !EndsAt(built.wall, opening, level.top_m)) continue;
      stretches.back().to_m = std::min(stretches.back().to_m, opening.from_m);
      stretches.push_back({std::max(stretches.back().from_m, opening.to_m), face.to_m});
    }
    if (stretches.size() == 1) cut.push_back(built);
    for (const Interval& stretch : stretches) {
      if (stretches.size() == 1 || stretch.length_m() <= 0) continue;
      BuiltFace part = CutToStretch(built, stretch);
      if (IsWall(part.wall.shares, part.wall.step_m)) cut.push_back(std::move(part));
    }
  }
  *faces = std::move(cut);
}

double ShareBeforeWalls(const std::vector<BuiltFace>& faces, const Eigen::Vector2d& from,
                        const Eigen::Vector2d& to) {
  constexpr double kThrough_m = 0.1;
  double least = 1;
  for (const BuiltFace& built : faces) {
    const Face& face = built.wall.face;
    const double before_m = face.DistanceTo(from), after_m = face.DistanceTo(to);
    if (!built.is_wall || before_m <= 0 || after_m >= -kThrough_m) continue;
    const double share = before_m / (before_m - after_m);
    const Eigen::Vector2d at = from + share * (to - from);
    const double along_m = face.MeasureAlong(at);
    const auto step = FindStep(built.wall, at);
    if (!step || built.wall.shares[*step] == 0) continue;
    const bool is_open =
        std::any_of(built.openings.begin(), built.openings.end(), [&](const FaceOpening& opening) {
          return opening.kind != OpeningKind::kWindow && along_m > opening.from_m &&
                 along_m < opening.to_m;
        });
    if (!is_open) least = std::min(least, share);
  }
  return least;
}

void CloseCorners(std::vector<BuiltFace>* faces) {
  std::vector<std::pair<double, double>> ends;
  for (const BuiltFace& built : *faces) {
    const Face& face = built.wall.face;
    ends.emplace_back(built.is_wall ? FindCorner(*faces, built, face.from_m) : face.from_m,
                      built.is_wall ? FindCorner(*faces, built, face.to_m) : face.to_m);
  }
  for (size_t i = 0; i < faces->size(); ++i) {
    Face& face = (*faces)[i].wall.face;
    if (ends[i].second > ends[i].first) std::tie(face.from_m, face.to_m) = ends[i];
  }
}

std::vector<PlanWall> PlanWalls(const std::vector<BuiltFace>& faces,
                                const std::vector<Level>& levels, const BuildingOptions& options) {
  const std::vector<size_t> order = MeasuredByLength(faces);
  std::vector<WallFace> seen;
  for (const size_t i : order) seen.push_back(faces[i].wall);
  const double typical_m = TypicalThickness(MakeBodies(seen, options), options);
  std::vector<bool> is_taken(faces.size(), false);
  std::vector<PlanWall> walls;
  for (const size_t i : order) {
    if (is_taken[i]) continue;
    is_taken[i] = true;
    const Face& front = faces[i].wall.face;
    const Level& level = levels[front.level];
    PlanWall wall = WallAlong(faces[i], level);
    wall.id = static_cast<int64_t>(walls.size());
    wall.thickness_m = typical_m;
    TakeBacks(faces, order, front, level, options, &is_taken, &wall);
    TakeInferred(faces, front, options, &is_taken, &wall);
    walls.push_back(wall);
  }
  return walls;
}

}  // namespace slcmap::mapping
