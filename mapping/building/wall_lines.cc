#include "mapping/building/wall_lines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;

// Rooms.
constexpr double kExtension_m = 30;  // of a wall's line beyond what was measured of it, at most

constexpr double kReach_m = 0.3;  // from where another wall ends at it to what was measured of it

// Whether a wall is covered somewhere between two places along it.
bool IsCoveredBetween(const WallFace& wall, double low_m, double high_m) {
  const auto step_of = [&](double at_m) {
    return static_cast<int64_t>(std::floor((at_m - wall.face.from_m) / wall.step_m));
  };
  const auto count = static_cast<int64_t>(wall.shares.size());
  const int64_t last = std::min(step_of(high_m), count - 1);
  for (int64_t step = std::max<int64_t>(0, step_of(low_m)); step <= last; ++step) {
    if (wall.shares[step] > 0) return true;
  }
  return false;
}

// Rounded corners, and what stands in them, hide both walls there.
bool IsCoveredNear(const WallFace& wall, double along_m) {
  constexpr double kCorner_m = 1;
  return IsCoveredBetween(wall, along_m - kCorner_m, along_m + kCorner_m);
}

// A wall that goes on at both sides, other than one that ends there.
bool IsCoveredAcross(const WallFace& wall, double along_m) {
  return IsCoveredBetween(wall, along_m - kReach_m, along_m - kReach_m / 2) &&
         IsCoveredBetween(wall, along_m + kReach_m / 2, along_m + kReach_m);
}

// Beyond both faces of another wall that goes across, where that was measured, no line goes on.
double FindExtension(const std::vector<WallFace>& walls, const WallFace& wall, bool at_end,
                     const BuildingOptions& options) {
  double extension_m = kExtension_m;
  for (const WallFace& other : walls) {
    const auto crossing = Crossing(wall.face, other.face);
    if (!crossing || !IsCoveredAcross(other, crossing->second)) continue;
    const double beyond_m =
        at_end ? crossing->first - wall.face.to_m : wall.face.from_m - crossing->first;
    if (beyond_m < -kReach_m) continue;
    extension_m = std::min(extension_m, std::max(beyond_m, 0.0) + options.max_thickness_m);
  }
  return extension_m;
}

// What the steps of a line are is a chain: each costs what was measured at it, and where one kind
// follows another a wall begins or ends. What was not seen is as what is beside it.
class LineChain {
 public:
  LineChain(const std::vector<WallFace>& walls, const WallFace& wall, const FreeSpace& free,
            const BuildingOptions& options)
      : walls_(walls), wall_(wall), free_(free) {
    const double step_m = wall.step_m;
    const auto steps = [&](bool at_end) {
      return static_cast<int>(std::ceil(FindExtension(walls, wall, at_end, options) / step_m));
    };
    before_ = steps(false);
    count_ = before_ + static_cast<int>(wall.shares.size()) + steps(true);
  }

  // The parts of least cost in all (Viterbi's).
  std::vector<WallPart> FindParts() const {
    const auto corners = FindCorners();
    std::array<double, 3> costs = {};
    std::vector<std::array<uint8_t, 3>> from(static_cast<size_t>(count_));
    for (int i = 0; i < count_; ++i) {
      std::array<double, 3> next = {};
      for (uint8_t to = 0; to < 3; ++to) {
        const auto along = [&](uint8_t kind) {
          return costs[kind] +
                 ChangeCost(kind, to, (to == kOpen ? corners.second : corners.first)[i]);
        };
        uint8_t best = to;
        for (uint8_t kind = 0; kind < 3; ++kind) {
          if (i > 0 && along(kind) < along(best)) best = kind;
        }
        from[static_cast<size_t>(i)][to] = best;
        next[to] = (i > 0 ? along(best) : 0) + wall_.step_m * ComputeCost(i, to);
      }
      costs = next;
    }
    auto kind = static_cast<uint8_t>(std::min_element(costs.begin(), costs.end()) - costs.begin());
    std::vector<uint8_t> kinds(static_cast<size_t>(count_));
    for (size_t i = kinds.size(); i-- > 0;) {
      kinds[i] = kind;
      kind = from[i][kind];
    }
    return MakeParts(kinds);
  }

 private:
  static constexpr uint8_t kWall = 0, kOpening = 1, kOpen = 2;

  double PlaceAt(double step) const { return wall_.face.from_m + (step - before_) * wall_.step_m; }

  bool IsCovered(int step) const {
    const int at = step - before_;
    return at >= 0 && at < static_cast<int>(wall_.shares.size()) &&
           wall_.shares[static_cast<size_t>(at)] > 0 && !IsIn(wall_.gaps, step);
  }

  bool IsIn(const std::vector<Interval>& parts, int step) const {
    const double at_m = PlaceAt(step + 0.5);
    return std::ranges::any_of(
        parts, [&](const Interval& part) { return at_m > part.from_m && at_m < part.to_m; });
  }

  // Nats a metre: what is measured of neighbouring steps is alike.
  double ComputeCost(int step, uint8_t kind) const {
    constexpr double kSeen = 10, kWidth = 3, kUnseen = 0.5, kNever = 1000;
    if (IsIn(wall_.gaps, step)) return kind == kOpen ? 0 : kNever;
    if (kind == kOpening && IsIn(wall_.doors, step)) return 0;
    if (kind != kWall) return (IsCovered(step) ? kSeen : 0) + (kind == kOpening ? kWidth : 0);
    if (IsCovered(step)) return 0;
    // Just behind the face: rays along a wall pass right before it.
    const Eigen::Vector2d p =
        wall_.face.PointAt(PlaceAt(step + 0.5)) - wall_.step_m * wall_.face.normal;
    return free_.IsFree(p) ? kSeen : kUnseen;
  }

  // Walls begin and end at other walls, but for those that stand free.
  static double ChangeCost(uint8_t from, uint8_t to, bool is_corner) {
    constexpr double kJamb = 1, kCorner = 0.5, kFreeEnd = 6;
    if (from == to) return 0;
    if (from != kOpen && to != kOpen) return kJamb;
    return is_corner ? kCorner : kFreeEnd;
  }

  // By step, whether another wall ends or crosses at it, so that this one may begin with it; or
  // just before it, so that this one may end there. No gap is left between them.
  std::pair<std::vector<bool>, std::vector<bool>> FindCorners() const {
    constexpr double kRounding = 1e-6;
    std::vector<bool> begins(static_cast<size_t>(count_), false), ends = begins;
    const auto set = [&](double step, std::vector<bool>* at) {
      if (step >= 0 && step < count_) (*at)[static_cast<size_t>(step)] = true;
    };
    for (const WallFace& other : walls_) {
      const auto crossing = Crossing(wall_.face, other.face);
      if (!crossing || !IsCoveredNear(other, crossing->second)) continue;
      const double at = (crossing->first - wall_.face.from_m) / wall_.step_m + before_;
      set(std::floor(at + kRounding), &begins);
      set(std::ceil(at - kRounding), &ends);
    }
    return {begins, ends};
  }

  std::vector<WallPart> MakeParts(const std::vector<uint8_t>& kinds) const {
    std::vector<WallPart> parts;
    for (int i = 0; i < count_; ++i) {
      const uint8_t kind = kinds[static_cast<size_t>(i)];
      const WallPart part{PlaceAt(i), PlaceAt(i + 1), kind == kWall, kind != kOpen,
                          kind == kWall && IsCovered(i)};
      if (!parts.empty() && parts.back().IsLike(part)) {
        parts.back().to_m = part.to_m;
      } else {
        parts.push_back(part);
      }
    }
    return parts;
  }

  const std::vector<WallFace>& walls_;
  const WallFace& wall_;
  const FreeSpace& free_;
  int before_ = 0, count_ = 0;  // steps before the face, and in all
};

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

std::vector<WallLine> CollectLines(const std::vector<WallFace>& walls, const FreeSpace& free,
                                   const BuildingOptions& options) {
  std::vector<WallLine> lines;
  for (const WallFace& wall : walls) {
    lines.push_back({&wall, LineChain(walls, wall, free, options).FindParts()});
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
      if (!best || part.Rank() > best->Rank()) best = part;
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
  for (auto* parts : {&back.doors, &back.gaps}) {
    for (Interval& part : *parts) part = {-part.to_m, -part.from_m};
  }
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
  if (bodies.empty()) return options.assumed_thickness_m;
  const auto middle = bodies.begin() + static_cast<std::ptrdiff_t>((bodies.size() - 1) / 2);
  std::ranges::nth_element(bodies, middle, {}, &WallBody::thickness_m);
  return middle->thickness_m;
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

bool IsInWall(const std::vector<WallLine>& lines, const std::vector<WallBody>& bodies,
              const Eigen::Vector2d& p) {
  return std::any_of(bodies.begin(), bodies.end(), [&](const WallBody& body) {
    const WallLine& line = lines[body.front];
    if (!IsIn(line.wall->face, body, p)) return false;
    const double along_m = line.wall->face.MeasureAlong(p);
    return std::any_of(line.parts.begin(), line.parts.end(), [&](const WallPart& part) {
      return part.parts_rooms && along_m >= part.from_m && along_m <= part.to_m;
    });
  });
}

}  // namespace slcmap::mapping
