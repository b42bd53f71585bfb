#include "tests/testing/built_from_plan.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace slcmap::testing {
namespace {

using Eigen::Vector2d;

double CrossProduct(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// What a walk sees of faces.
class Sight {
 public:
  explicit Sight(const std::vector<PlannedFace>& faces) : faces_(faces) {
    Eigen::AlignedBox2d box;
    for (const PlannedFace& face : faces) {
      box.extend(face.start).extend(face.end);
      seen_.emplace_back(static_cast<std::size_t>(face.Length() / kBin_m) + 1);
    }
    const Eigen::Vector2i size = (box.sizes() / kBin_m).array().ceil().cast<int>() + 1;
    free_ = {box.min(), kBin_m, cv::Mat1b(size.y(), size.x(), uchar{0})};
  }

  void LookAround(const Vector2d& from) {
    constexpr int kRays = 240;
    constexpr double kRange_m = 8;
    for (int ray = 0; ray < kRays; ++ray) {
      const double angle_rad = 2 * std::numbers::pi * ray / kRays;
      const Vector2d direction(std::cos(angle_rad), std::sin(angle_rad));
      double range_m = kRange_m;
      const int face = Cast(from, direction, &range_m);
      const cv::Rect cells({0, 0}, free_.free.size());
      for (double at_m = 0; at_m < range_m - kBin_m; at_m += 0.5 * kBin_m) {
        const Vector2d cell = ((from + at_m * direction - free_.least) / kBin_m).array().floor();
        const cv::Point at(static_cast<int>(cell.x()), static_cast<int>(cell.y()));
        if (cells.contains(at)) free_.free(at) = 1;
      }
      if (face < 0) continue;
      const double along_m = (from + range_m * direction - faces_[face].start).norm();
      std::vector<bool>& seen = seen_[static_cast<std::size_t>(face)];
      seen[std::min(seen.size() - 1, static_cast<std::size_t>(along_m / kBin_m))] = true;
    }
  }

  // Of a face, from its start; nothing of what hardly anything was seen.
  std::optional<Interval> Seen(std::size_t face) const {
    const std::vector<bool>& seen = seen_[face];
    const auto first = std::ranges::find(seen, true);
    const auto last = std::find(seen.rbegin(), seen.rend(), true).base();
    if (last - first < 5 || 2 * std::count(first, last, true) < last - first) return std::nullopt;
    return Interval{
        kBin_m * static_cast<double>(first - seen.begin()),
        std::min(faces_[face].Length(), kBin_m * static_cast<double>(last - seen.begin()))};
  }

  const FreeCells& free() const { return free_; }

 private:
  // The first face that a ray hits, or -1.
  int Cast(const Vector2d& from, const Vector2d& direction, double* range_m) const {
    int hit = -1;
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      const Vector2d side = faces_[i].end - faces_[i].start, off = faces_[i].start - from;
      const double across = CrossProduct(direction, side);
      const double at = CrossProduct(off, side) / across,
                   share = CrossProduct(off, direction) / across;
      if (!(share >= 0 && share <= 1 && at > 0 && at < *range_m)) continue;
      *range_m = at;
      hit = static_cast<int>(i);
    }
    return hit;
  }

  static constexpr double kBin_m = 0.1;
  const std::vector<PlannedFace>& faces_;
  std::vector<std::vector<bool>> seen_;
  FreeCells free_;
};

}  // namespace

MadeStorey BuildFromPlan(const BuildingPlan& plan, const std::vector<Vector2d>& walk,
                         const BuildOtherwise& how) {
  std::mt19937 random(how.seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1, 1);
  const PlanPose back{-how.T_plan_world.yaw_rad, Vector2d::Zero()};
  const PlanPose T_world_plan{back.yaw_rad, -back.Turn(how.T_plan_world.shift)};
  MadeStorey made;
  std::vector<PlannedFace> faces = plan.faces;
  for (PlannedFace& face : faces) {
    double& deviation_m = made.deviation_m.emplace_back(0);
    if (face.Length() >= 1 && std::abs(uniform(random)) < how.deviating_share) {
      const double off = uniform(random);
      deviation_m = std::copysign(0.005, off) + 0.045 * off;
    }
    const Vector2d shift = deviation_m * face.Normal();
    face.start = T_world_plan * (face.start + shift), face.end = T_world_plan * (face.end + shift);
  }
  Sight sight(faces);
  for (std::size_t i = 0; i + 1 < walk.size(); ++i) {
    const Vector2d way = walk[i + 1] - walk[i];
    for (double at_m = 0; at_m < way.norm(); at_m += 0.4) {
      made.storey.trajectory.push_back(T_world_plan * (walk[i] + at_m * way.normalized()));
      sight.LookAround(made.storey.trajectory.back());
    }
  }
  made.storey.free = sight.free();
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const auto seen = sight.Seen(i);
    if (!seen) continue;
    const double off_m = how.sigma_m * normal(random),
                 turned_m = how.sigma_m * std::sqrt(3.0) * normal(random);
    PlannedFace face = faces[i];
    const Vector2d start = face.start, along = face.Along(), across = face.Normal();
    face.sigma_m = how.sigma_m;
    face.start = start + seen->from_m * along + (off_m - turned_m) * across;
    face.end = start + seen->to_m * along + (off_m + turned_m) * across;
    made.storey.faces.push_back({face, static_cast<int64_t>(i)});
  }
  for (const PlannedOpening& opening : plan.openings) {
    const PlannedOpening built{T_world_plan * opening.start, T_world_plan * opening.end};
    if (sight.free().IsFree(0.5 * (built.start + built.end))) {
      made.storey.openings.push_back({built, 0});
    }
  }
  return made;
}

namespace {

constexpr double kDoor_m = 0.9;

// Rooms beside the corridor: where their walls are, and how far from these their doors.
struct RoomRow {
  std::vector<double> walls_m;
  double corridor_m, outside_m, first_door_m, next_door_m;

  double DoorAt(std::size_t room) const {
    return walls_m[room] + first_door_m + next_door_m * static_cast<double>(room);
  }
};

const RoomRow kRows[] = {{{0, 4.1, 7.7, 13.9, 17.2}, 5.9, 0, 0.5, 0.3},
                         {{0, 6.3, 9.5, 13, 17.2}, 8.1, 14, 0.9, 0.2}};
constexpr double kEnd_m = 17.2, kCorridor_m = 7;
const PlanPose kWing{std::numbers::pi / 6, {kEnd_m + 0.2, 5.4}};

Polygon Wall(const Vector2d& from, const Vector2d& to, double thickness_m) {
  const Vector2d along = 0.5 * thickness_m * (to - from).normalized(), side(-along.y(), along.x());
  return {{from - side - along, to - side + along, to + side + along, from + side - along}, {}};
}

}  // namespace

BuildingPlan MakeOfficePlan(bool is_rebuilt) {
  constexpr double kOutside_m = 0.3, kInside_m = 0.12;
  std::vector<Polygon> walls = {
      Wall({0, 0}, {kEnd_m, 0}, kOutside_m), Wall({0, 14}, {kEnd_m, 14}, kOutside_m),
      Wall({0, 0}, {0, 14}, kOutside_m), Wall({kEnd_m, 0}, {kEnd_m, 6.15}, kOutside_m),
      Wall({kEnd_m, 7.85}, {kEnd_m, 14}, kOutside_m)};
  for (const RoomRow& row : kRows) {
    for (std::size_t i = 0; i + 1 < row.walls_m.size(); ++i) {
      const double x_m = row.walls_m[i], door_m = row.DoorAt(i), aside_m = 0.5 * kInside_m;
      walls.push_back(Wall({x_m, row.corridor_m}, {door_m - aside_m, row.corridor_m}, kInside_m));
      walls.push_back(Wall({door_m + kDoor_m + aside_m, row.corridor_m},
                           {row.walls_m[i + 1], row.corridor_m}, kInside_m));
      if (i == 0 || (is_rebuilt && x_m == kLackingWall.x())) continue;
      walls.push_back(Wall({x_m, row.outside_m}, {x_m, row.corridor_m}, kInside_m));
    }
  }
  walls.push_back(Wall(kWing * Vector2d(0.6, -0.4), kWing * Vector2d(11, -0.4), 0.2));
  walls.push_back(Wall(kWing * Vector2d(1.7, 3.1), kWing * Vector2d(11, 3.1), 0.2));
  walls.push_back(Wall(kWing * Vector2d(11, -0.4), kWing * Vector2d(11, 3.1), 0.2));
  if (is_rebuilt) {
    for (const Vector2d& at : kNewWalls) {
      walls.push_back(Wall(at - Vector2d(1, 0), at + Vector2d(1, 0), kInside_m));
    }
  }
  BuildingPlan plan;
  for (const Polygon& area : Union(walls, 1e-3)) AddFaces(area, false, &plan);
  for (PlannedFace& face : plan.faces) face.sigma_m = 0.001;
  FindOpenings(&plan);
  return plan;
}

std::vector<Vector2d> WalkThroughOffice() {
  std::vector<Vector2d> walk = {{0.5, kCorridor_m}};
  for (std::size_t room = 0; room < 4; ++room) {
    for (const RoomRow& row : kRows) {
      const double x_m = row.DoorAt(room) + 0.5 * kDoor_m;
      const double in_m = row.corridor_m + (row.outside_m > kCorridor_m ? 2 : -2);
      walk.insert(walk.end(), {{x_m, kCorridor_m}, {x_m, in_m}, {x_m, kCorridor_m}});
    }
  }
  walk.insert(walk.end(),
              {{kEnd_m, kCorridor_m}, kWing * Vector2d(3, 1.4), kWing * Vector2d(9, 1.4)});
  return walk;
}

}  // namespace slcmap::testing
