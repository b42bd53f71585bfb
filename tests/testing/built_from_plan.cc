#include "tests/testing/built_from_plan.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <queue>
#include <random>

namespace slcmap::testing {
namespace {

using Eigen::Vector2d;

double CrossProduct(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

double DistanceTo(const PlannedFace& face, const Vector2d& p) {
  const double along_m = std::clamp(face.Along().dot(p - face.start), 0.0, face.Length());
  return (face.start + along_m * face.Along() - p).norm();
}

// The first face that a ray hits within its range.
struct Hit {
  int face = -1;
  double range_m = 0;
};

Hit Cast(const std::vector<PlannedFace>& faces, const std::vector<int>& near, const Vector2d& from,
         const Vector2d& direction, double range_m) {
  Hit hit{-1, range_m};
  for (const int i : near) {
    const Vector2d side = faces[i].end - faces[i].start, off = faces[i].start - from;
    const double across = CrossProduct(direction, side);
    if (std::abs(across) < 1e-9) continue;
    const double at = CrossProduct(off, side) / across,
                 share = CrossProduct(off, direction) / across;
    if (share >= 0 && share <= 1 && at > 0 && at < hit.range_m) hit = {i, at};
  }
  return hit;
}

// What a walk sees of faces, in the plan's coordinates.
class Sight {
 public:
  Sight(const std::vector<PlannedFace>& faces, double range_m) : faces_(faces), range_m_(range_m) {
    Eigen::AlignedBox2d box;
    for (const PlannedFace& face : faces) {
      box.extend(face.start).extend(face.end);
      seen_.emplace_back(static_cast<std::size_t>(face.Length() / kBin_m) + 1);
    }
    least_ = box.min();
    size_ = ((box.sizes() / kBin_m).array().ceil().cast<int>() + 1);
    free_ = cv::Mat1b::zeros(size_.y(), size_.x());
  }

  void LookAround(const Vector2d& from) {
    std::vector<int> near;
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      if (DistanceTo(faces_[i], from) < range_m_) near.push_back(static_cast<int>(i));
    }
    constexpr int kRays = 240;
    for (int ray = 0; ray < kRays; ++ray) {
      const double angle_rad = 2 * std::numbers::pi * ray / kRays;
      const Vector2d direction(std::cos(angle_rad), std::sin(angle_rad));
      const Hit hit = Cast(faces_, near, from, direction, range_m_);
      for (double at = 0; at < hit.range_m - kBin_m; at += 0.5 * kBin_m) {
        const Vector2d cell = (from + at * direction - least_) / kBin_m;
        if (cell.minCoeff() < 0 || cell.x() >= size_.x() || cell.y() >= size_.y()) continue;
        free_(static_cast<int>(cell.y()), static_cast<int>(cell.x())) = 1;
      }
      if (hit.face < 0) continue;
      const Vector2d p = from + hit.range_m * direction;
      const double along_m = (p - faces_[hit.face].start).norm();
      std::vector<bool>& seen = seen_[static_cast<std::size_t>(hit.face)];
      seen[std::min(seen.size() - 1, static_cast<std::size_t>(along_m / kBin_m))] = true;
    }
  }

  // Of a face, from its start; nothing of what hardly anything was seen.
  std::optional<std::pair<double, double>> Seen(std::size_t face) const {
    const std::vector<bool>& seen = seen_[face];
    const auto first = std::ranges::find(seen, true);
    if (first == seen.end()) return std::nullopt;
    const auto last = std::find(seen.rbegin(), seen.rend(), true).base();
    if (last - first < 5 || 2 * std::count(first, last, true) < last - first) return std::nullopt;
    return std::pair(
        kBin_m * static_cast<double>(first - seen.begin()),
        std::min(faces_[face].Length(), kBin_m * static_cast<double>(last - seen.begin())));
  }

  bool IsFree(const Vector2d& p) const { return FreeCells{least_, kBin_m, free_}.IsFree(p); }
  const cv::Mat1b& free() const { return free_; }
  const Vector2d& least() const { return least_; }
  static constexpr double kBin_m = 0.1;

 private:
  const std::vector<PlannedFace>& faces_;
  const double range_m_;
  std::vector<std::vector<bool>> seen_;
  Vector2d least_ = Vector2d::Zero();
  Eigen::Vector2i size_ = Eigen::Vector2i::Zero();
  cv::Mat1b free_;
};

PlanPose Inverse(const PlanPose& pose) {
  const PlanPose turn{-pose.yaw_rad, Vector2d::Zero()};
  return {-pose.yaw_rad, -turn.Turn(pose.shift)};
}

// What was seen, turned into the world of a map.
FreeCells InWorld(const Sight& sight, const PlanPose& T_world_plan) {
  Eigen::AlignedBox2d box;
  const cv::Mat1b& free = sight.free();
  const Vector2d size = Sight::kBin_m * Vector2d(free.cols, free.rows);
  for (const Vector2d& corner :
       {Vector2d(0, 0), Vector2d(size.x(), 0), Vector2d(0, size.y()), size}) {
    box.extend(T_world_plan * (sight.least() + corner));
  }
  FreeCells cells{box.min(), Sight::kBin_m, {}};
  const Eigen::Vector2i count = (box.sizes() / cells.cell_m).array().ceil().cast<int>();
  cells.free = cv::Mat1b::zeros(count.y(), count.x());
  const PlanPose T_plan_world = Inverse(T_world_plan);
  for (int row = 0; row < count.y(); ++row) {
    for (int column = 0; column < count.x(); ++column) {
      const Vector2d p = cells.least + cells.cell_m * Vector2d(column + 0.5, row + 0.5);
      cells.free(row, column) = sight.IsFree(T_plan_world * p);
    }
  }
  return cells;
}

class PlanBuilder {
 public:
  PlanBuilder(const BuildingPlan& plan, const std::vector<Vector2d>& walk,
              const BuildOtherwise& how)
      : plan_(plan), walk_(walk), random_(how.seed) {
    made_.how = how;
    faces_ = plan.faces;
    deviations_.assign(faces_.size(), 0);
    for (std::size_t i = 0; i < faces_.size(); ++i) origin_.push_back(i);
    Deviate();
    LeaveOut();
    for (int i = 0; i < how.extra_walls; ++i) AddWall();
  }

  MadeStorey Build() {
    Sight sight(faces_, made_.how.range_m);
    for (const Vector2d& p : walk_) sight.LookAround(p);
    const PlanPose T_world_plan = Inverse(made_.how.T_plan_world);
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      const auto seen = sight.Seen(i);
      if (!seen) continue;
      PlannedFace face = faces_[i];
      face.start = faces_[i].start + seen->first * faces_[i].Along();
      face.end = faces_[i].start + seen->second * faces_[i].Along();
      AddNoise(&face);
      face.start = T_world_plan * face.start, face.end = T_world_plan * face.end;
      made_.storey.faces.push_back({face, static_cast<int64_t>(i)});
      made_.planned.push_back(origin_[i]);
      made_.deviation_m.push_back(deviations_[i]);
    }
    for (const PlannedOpening& opening : plan_.openings) {
      if (!sight.IsFree(0.5 * (opening.start + opening.end))) continue;
      made_.storey.openings.push_back(
          {{T_world_plan * opening.start, T_world_plan * opening.end}, 0});
    }
    for (const Vector2d& p : walk_) made_.storey.trajectory.push_back(T_world_plan * p);
    made_.storey.free = InWorld(sight, T_world_plan);
    for (const auto& [index, face] : left_out_) {
      if (sight.IsFree(face.Middle() + 0.15 * face.Normal())) made_.missing.push_back(index);
    }
    return std::move(made_);
  }

 private:
  double Uniform(double least, double most) {
    return least + (most - least) * static_cast<double>(random_()) / 4294967295.0;
  }
  double Normal() { return std::normal_distribution<double>()(random_); }

  void Deviate() {
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      if (faces_[i].Length() < 1 || Uniform(0, 1) > made_.how.deviating_share) continue;
      deviations_[i] = Uniform(0.005, 0.05) * (random_() % 2 == 0 ? 1 : -1);
      const Vector2d shift = deviations_[i] * faces_[i].Normal();
      faces_[i].start += shift, faces_[i].end += shift;
    }
  }

  // Walls with both of their faces.
  void LeaveOut() {
    std::vector<bool> leaves(faces_.size());
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      if (faces_[i].Length() < 2 || Uniform(0, 1) > made_.how.missing_share) continue;
      for (std::size_t k = 0; k < faces_.size(); ++k) {
        const double off_m = faces_[i].Normal().dot(faces_[k].Middle() - faces_[i].Middle());
        const double along_m = faces_[i].Along().dot(faces_[k].Middle() - faces_[i].start);
        leaves[k] = leaves[k] || k == i ||
                    (faces_[i].Normal().dot(faces_[k].Normal()) < -0.99 && off_m < 0 &&
                     off_m > -0.4 && along_m > 0 && along_m < faces_[i].Length());
      }
    }
    std::vector<PlannedFace> kept;
    std::vector<double> deviations;
    std::vector<std::size_t> origin;
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      if (leaves[i]) {
        if (faces_[i].Length() > 1) left_out_.emplace_back(i, faces_[i]);
        continue;
      }
      kept.push_back(faces_[i]), deviations.push_back(deviations_[i]), origin.push_back(i);
    }
    faces_ = kept, deviations_ = deviations, origin_ = origin;
  }

  // Where it stands in nobody's way.
  void AddWall() {
    for (int trial = 0; trial < 200; ++trial) {
      const Vector2d at =
          walk_[random_() % walk_.size()] + Vector2d(Uniform(-4, 4), Uniform(-4, 4));
      const Vector2d along = random_() % 2 == 0 ? Vector2d(1, 0) : Vector2d(0, 1);
      const PlannedFace face{at - along, at + along};
      const auto is_near = [&](const Vector2d& p) { return DistanceTo(face, p) < 0.6; };
      const auto stands_near = [&](const PlannedFace& other) {
        return is_near(other.start) || is_near(other.end) || DistanceTo(other, face.start) < 0.6 ||
               DistanceTo(other, face.end) < 0.6 ||
               Cross(face.start, face.end, other.start, other.end);
      };
      if (std::ranges::any_of(walk_, is_near) || std::ranges::any_of(faces_, stands_near)) continue;
      const Vector2d back = -0.1 * face.Normal();
      for (const PlannedFace& side : {face, PlannedFace{face.end + back, face.start + back}}) {
        faces_.push_back(side), deviations_.push_back(0), origin_.push_back(plan_.faces.size());
      }
      return;
    }
  }

  void AddNoise(PlannedFace* face) {
    const double sigma_m = made_.how.sigma_m;
    face->sigma_m = sigma_m;
    const Vector2d normal = face->Normal();
    const double off_m = sigma_m * Normal(), turned_m = sigma_m * std::sqrt(3.0) * Normal();
    face->start += (off_m - turned_m) * normal;
    face->end += (off_m + turned_m) * normal;
  }

  const BuildingPlan& plan_;
  const std::vector<Vector2d>& walk_;
  std::mt19937 random_;
  std::vector<PlannedFace> faces_;
  std::vector<double> deviations_;
  std::vector<std::size_t> origin_;
  std::vector<std::pair<std::size_t, PlannedFace>> left_out_;
  MadeStorey made_;
};

}  // namespace

MadeStorey BuildFromPlan(const BuildingPlan& plan, const std::vector<Vector2d>& walk,
                         const BuildOtherwise& how) {
  return PlanBuilder(plan, walk, how).Build();
}

namespace {

// Places to walk on, by cells, and the way between them.
class WalkGrid {
 public:
  WalkGrid(const BuildingPlan& plan) {
    Eigen::AlignedBox2d box;
    for (const PlannedFace& face : plan.faces) box.extend(face.start).extend(face.end);
    least_ = box.min();
    const Eigen::Vector2i size = (box.sizes() / kCell_m).array().ceil().cast<int>() + 1;
    taken_ = cv::Mat1b::zeros(size.y(), size.x());
    for (const PlannedFace& face : plan.faces) {
      for (double at = 0; at <= face.Length(); at += 0.5 * kCell_m) {
        const cv::Point cell = CellAt(face.start + at * face.Along());
        const int reach = 2;  // 0.4 m from walls
        for (int y = -reach; y <= reach; ++y) {
          for (int x = -reach; x <= reach; ++x) Take(cell + cv::Point(x, y));
        }
      }
    }
  }

  cv::Point CellAt(const Vector2d& p) const {
    const Vector2d cell = (p - least_) / kCell_m;
    return {static_cast<int>(cell.x()), static_cast<int>(cell.y())};
  }
  Vector2d PlaceOf(const cv::Point& cell) const {
    return least_ + kCell_m * Vector2d(cell.x + 0.5, cell.y + 0.5);
  }

  // Steps from a cell to all others; -1: none.
  cv::Mat1i StepsFrom(const cv::Point& start) const {
    cv::Mat1i steps(taken_.size(), -1);
    std::queue<cv::Point> open;
    steps(start) = 0;
    for (open.push(start); !open.empty(); open.pop()) {
      const cv::Point cell = open.front();
      for (const cv::Point& to :
           {cv::Point(1, 0), cv::Point(-1, 0), cv::Point(0, 1), cv::Point(0, -1)}) {
        const cv::Point next = cell + to;
        if (!Holds(next) || taken_(next) != 0 || steps(next) >= 0) continue;
        steps(next) = steps(cell) + 1;
        open.push(next);
      }
    }
    return steps;
  }

  bool Holds(const cv::Point& cell) const { return cv::Rect({0, 0}, taken_.size()).contains(cell); }
  static constexpr double kCell_m = 0.2;

 private:
  void Take(const cv::Point& cell) {
    if (Holds(cell)) taken_(cell) = 1;
  }

  Vector2d least_ = Vector2d::Zero();
  cv::Mat1b taken_;
};

}  // namespace

std::vector<Vector2d> InventWalk(const BuildingPlan& plan, const Vector2d& start, double length_m,
                                 unsigned seed) {
  const WalkGrid grid(plan);
  std::mt19937 random(seed);
  std::vector<Vector2d> walk = {start};
  cv::Point at = grid.CellAt(start);
  for (double walked_m = 0; walked_m < length_m;) {
    const cv::Mat1i steps = grid.StepsFrom(at);
    std::vector<cv::Point> reached;
    for (int y = 0; y < steps.rows; ++y) {
      for (int x = 0; x < steps.cols; ++x) {
        if (steps(y, x) * grid.kCell_m > 6) reached.emplace_back(x, y);
      }
    }
    if (reached.empty()) break;
    // Back from there, each cell's neighbour that is one step nearer.
    std::vector<cv::Point> way = {reached[random() % reached.size()]};
    while (way.back() != at) {
      for (const cv::Point& to :
           {cv::Point(1, 0), cv::Point(-1, 0), cv::Point(0, 1), cv::Point(0, -1)}) {
        const cv::Point next = way.back() + to;
        if (!grid.Holds(next) || steps(next) != steps(way.back()) - 1) continue;
        way.push_back(next);
        break;
      }
    }
    at = way.front();
    for (std::size_t i = way.size(); i-- > 0 && walked_m < length_m;) {
      if (i % 2 == 0) walk.push_back(grid.PlaceOf(way[i]));
      walked_m += grid.kCell_m;
    }
  }
  return walk;
}

BuildingPlan MakeOfficePlan() {
  constexpr double kGrid_m = 1e-3;
  std::vector<Polygon> walls;
  const auto add = [&](const Vector2d& from, const Vector2d& to, double thickness_m) {
    const Vector2d along = (to - from).normalized();
    const Vector2d side = 0.5 * thickness_m * Vector2d(-along.y(), along.x());
    const Vector2d beyond = 0.5 * thickness_m * along;
    walls.push_back(
        {{from - side - beyond, to - side + beyond, to + side + beyond, from + side - beyond}, {}});
  };
  const auto add_with_door = [&](const Vector2d& from, const Vector2d& to, double thickness_m,
                                 double door_m, double width_m) {
    const Vector2d along = (to - from).normalized();
    add(from, from + (door_m - 0.5 * thickness_m) * along, thickness_m);
    add(from + (door_m + width_m + 0.5 * thickness_m) * along, to, thickness_m);
  };
  add({0, 0}, {30, 0}, 0.3), add({0, 14}, {30, 14}, 0.3), add({0, 0}, {0, 14}, 0.3);
  add_with_door({30, 0}, {30, 14}, 0.3, 6.3, 1.4);
  const std::vector<double> below = {0, 4.1, 7.7, 13.9, 17.2, 24.6, 30};
  const std::vector<double> above = {0, 6.3, 9.5, 15.2, 21.3, 25.1, 30};
  for (std::size_t i = 0; i + 1 < below.size(); ++i) {
    add_with_door({below[i], 5.9}, {below[i + 1], 5.9}, 0.12, 0.5 + 0.3 * static_cast<double>(i),
                  0.9);
    add_with_door({above[i], 8.1}, {above[i + 1], 8.1}, 0.12, 0.9 + 0.2 * static_cast<double>(i),
                  0.9);
    if (i > 0) add({below[i], 0}, {below[i], 5.9}, 0.12);
    if (i > 0) add({above[i], 8.1}, {above[i], 14}, 0.12);
  }
  // A wing behind the door at the end.
  const double turn_rad = std::numbers::pi / 6;
  const PlanPose wing{turn_rad, {30.2, 5.4}};
  add(wing * Vector2d(0.6, -0.4), wing * Vector2d(11, -0.4), 0.2);
  add(wing * Vector2d(1.7, 3.1), wing * Vector2d(11, 3.1), 0.2);
  add(wing * Vector2d(11, -0.4), wing * Vector2d(11, 3.1), 0.2);
  BuildingPlan plan;
  for (const Polygon& area : Union(walls, kGrid_m)) AddFaces(area, false, &plan);
  for (PlannedFace& face : plan.faces) face.sigma_m = 0.001;
  FindOpenings(&plan);
  return plan;
}

}  // namespace slcmap::testing
