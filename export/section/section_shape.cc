#include "export/section/section_shape.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "export/section/hidden_lines.h"

namespace slcmap {
namespace {

using Eigen::AlignedBox2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kSameFace_m = 2e-3;

// A side of walls that looks to the eye, from left to right: x of the view, and depth.
struct WallSide {
  Vector2d left, right;
  double low_m = 0, high_m = 0;
  bool is_assumed = false, top_assumed = false;
  bool cut_left = false, cut_right = false;  // it goes on before the plane
};

ViewedLine Viewed(Pen pen, const Vector2d& a, double a_height_m, const Vector2d& b,
                  double b_height_m, double before_m) {
  return {pen, {a.x(), a_height_m, a.y()}, {b.x(), b_height_m, b.y()}, before_m};
}

// Beyond the plane; nothing where it ends before it, or looks away.
std::optional<WallSide> SideBeyond(const Vector2d& start, const Vector2d& end) {
  WallSide side;
  side.left = start;
  side.right = end;
  const Vector2d along = end - start;
  if (along.x() < kLeastSolid_m || std::max(start.y(), end.y()) <= 0) return std::nullopt;
  const Vector2d at_plane = start - start.y() / (along.y() == 0 ? 1 : along.y()) * along;
  side.cut_left = start.y() < 0;
  side.cut_right = end.y() < 0;
  if (side.cut_left) side.left = at_plane;
  if (side.cut_right) side.right = at_plane;
  return side;
}

void AddSideLines(const WallSide& side, std::vector<ViewedLine>* lines) {
  const Pen pen = side.is_assumed ? Pen::kAssumed : Pen::kBeyond;
  const Pen top = side.top_assumed ? Pen::kAssumed : pen;
  const auto add = [&](Pen of, const Vector2d& a, double a_m, const Vector2d& b, double b_m) {
    lines->push_back(Viewed(of, a, a_m, b, b_m, kSameFace_m));
  };
  add(pen, side.left, side.low_m, side.right, side.low_m);
  add(top, side.left, side.high_m, side.right, side.high_m);
  if (!side.cut_left) add(pen, side.left, side.low_m, side.left, side.high_m);
  if (!side.cut_right) add(pen, side.right, side.low_m, side.right, side.high_m);
}

// The side without its holes, which are in the order of x.
void AddScreens(const WallSide& side, const std::vector<AlignedBox2d>& holes,
                std::vector<Screen>* screens) {
  const auto add = [&](double from_m, double to_m, double low_m, double high_m) {
    if (to_m - from_m < kLeastSolid_m || high_m - low_m < kLeastSolid_m) return;
    const auto depth_m = [&](double x_m) {
      const Vector2d along = side.right - side.left;
      return side.left.y() + (x_m - side.left.x()) / along.x() * along.y();
    };
    screens->push_back(
        {{Vector2d(from_m, low_m), Vector2d(to_m, high_m)}, depth_m(from_m), depth_m(to_m)});
  };
  double from_m = side.left.x();
  for (const AlignedBox2d& hole : holes) {
    const double left_m = std::clamp(hole.min().x(), from_m, side.right.x());
    const double right_m = std::clamp(hole.max().x(), from_m, side.right.x());
    add(from_m, left_m, side.low_m, side.high_m);
    add(left_m, right_m, side.low_m, hole.min().y());
    add(left_m, right_m, hole.max().y(), side.high_m);
    from_m = right_m;
  }
  add(from_m, side.right.x(), side.low_m, side.high_m);
}

// What is beyond the plane, before it is known what hides it.
class BeyondCut {
 public:
  BeyondCut(const SectionView& view, const std::vector<TallWall>& walls)
      : view_(view), walls_(walls) {}

  // The outer sides of walls of the same storey and height, which are one where they meet.
  void AddWalls() {
    std::map<std::pair<double, double>, std::vector<const TallWall*>> groups;
    for (const TallWall& wall : walls_) {
      groups[{wall.height.floor_m, wall.Top_m()}].push_back(&wall);
      AddOpenings(wall);
    }
    for (const auto& [heights, walls] : groups) AddSides(walls);
  }

  void AddLine(const Vector3d& start, const Vector3d& end) {
    constexpr double kOnWall_m = 0.08;  // so far behind its wall's face a line may be
    lines_.push_back(Viewed(Pen::kLine, view_.At(start.head<2>()), start.z(),
                            view_.At(end.head<2>()), end.z(), kOnWall_m));
  }

  void Hide(const AlignedBox2d& cut) { screens_.push_back({cut, 0, 0}); }

  const AlignedBox2d& extent() const { return extent_; }

  std::vector<DrawnPath> Paths(const AlignedBox2d& extent) const {
    const Vector2d &low = extent.min(), &high = extent.max();
    return SeenParts(lines_, screens_,
                     {Vector3d(low.x(), low.y(), 0), Vector3d(high.x(), high.y(), view_.depth_m)});
  }

  // Those whose middle is seen.
  std::vector<SectionOpening> Openings() const {
    std::vector<SectionOpening> seen;
    for (const auto& [opening, depth_m] : openings_) {
      const Vector2d middle = opening.box.center();
      const bool is_in = depth_m > 0 && depth_m < view_.depth_m && middle.x() > view_.from_m &&
                         middle.x() < view_.to_m;
      if (is_in && !IsHidden(screens_, {middle.x(), middle.y(), depth_m}, kSameFace_m)) {
        seen.push_back(opening);
      }
    }
    return seen;
  }

 private:
  // The border on the wall's face and on its back; of the two, what is nearer counts.
  void AddOpenings(const TallWall& wall) {
    for (const PlanOpening& opening : wall.solid.wall->openings) {
      const std::optional<AlignedBox2d> hole = wall.Hole(opening);
      if (!hole) continue;
      SectionOpening nearer;
      double nearer_m = 0;
      for (const double behind_m : {0.0, wall.solid.Thickness()}) {
        const Vector2d from = view_.At(wall.solid.At(hole->min().x(), behind_m));
        const Vector2d to = view_.At(wall.solid.At(hole->max().x(), behind_m));
        const double low_m = hole->min().y(), high_m = hole->max().y();
        const auto add = [&](const Vector2d& a, double a_m, const Vector2d& b, double b_m) {
          lines_.push_back(Viewed(Pen::kOpening, a, a_m, b, b_m, kSameFace_m));
        };
        add(from, low_m, to, low_m);
        add(from, high_m, to, high_m);
        add(from, low_m, from, high_m);
        add(to, low_m, to, high_m);
        const double middle_m = 0.5 * (from.y() + to.y());
        if (nearer.opening != nullptr && middle_m > nearer_m) continue;
        nearer = {&opening,
                  AlignedBox2d(Vector2d(std::min(from.x(), to.x()), low_m),
                               Vector2d(std::max(from.x(), to.x()), high_m)),
                  false};
        nearer_m = middle_m;
      }
      if (nearer.box.sizes().x() > kSameFace_m) openings_.emplace_back(nearer, nearer_m);
    }
  }

  void AddSides(const std::vector<const TallWall*>& walls) {
    constexpr double kGrid_m = 1e-5, kLeastHole_m2 = 5e-3;
    std::vector<Polygon> pieces;
    std::vector<WallSolid> solids;
    for (const TallWall* wall : walls) {
      solids.push_back(wall->solid);
      pieces.push_back(MakePiece(wall->solid, 0, wall->solid.Length()));
    }
    for (const Polygon& area : Union(pieces, kGrid_m)) {
      AddRing(area.outline, walls, solids);
      for (const PlanPoints& hole : area.holes) {
        if (std::abs(SignedArea(hole)) > kLeastHole_m2) AddRing(hole, walls, solids);
      }
    }
  }

  // A border of walls, which are to the left of it.
  void AddRing(const PlanPoints& border, const std::vector<const TallWall*>& walls,
               const std::vector<WallSolid>& solids) {
    constexpr double kStraight_m = 1e-4;
    const PlanPoints ring = Straightened(border, kStraight_m, kStraight_m);
    for (size_t i = 0; i < ring.size(); ++i) {
      const Vector2d &start = ring[i], &end = ring[(i + 1) % ring.size()];
      std::optional<WallSide> side = SideBeyond(view_.At(start), view_.At(end));
      if (!side || std::min(side->left.y(), side->right.y()) > view_.depth_m) continue;
      if (side->left.x() > view_.to_m || side->right.x() < view_.from_m) continue;
      side->low_m = walls.front()->height.floor_m;
      side->high_m = walls.front()->Top_m();
      side->is_assumed = IsAssumedBorder(solids, 0.5 * (start + end));
      side->top_assumed = walls.front()->height.assumed;
      AddSideLines(*side, &lines_);
      AddScreens(*side, HolesOn(*side, walls), &screens_);
      extent_.extend(Vector2d(std::max(side->left.x(), view_.from_m), side->low_m));
      extent_.extend(Vector2d(std::min(side->right.x(), view_.to_m), side->high_m));
    }
  }

  std::vector<AlignedBox2d> HolesOn(const WallSide& side,
                                    const std::vector<const TallWall*>& walls) const {
    const Vector2d along = (side.right - side.left).normalized();
    const auto is_on = [&](const Vector2d& point) {
      const Vector2d from = point - side.left;
      return std::abs(along.x() * from.y() - along.y() * from.x()) < kSameFace_m;
    };
    std::vector<AlignedBox2d> holes;
    for (const TallWall* wall : walls) {
      for (const PlanOpening& opening : wall->solid.wall->openings) {
        const std::optional<AlignedBox2d> hole = wall->Hole(opening);
        if (!hole) continue;
        for (const double behind_m : {0.0, wall->solid.Thickness()}) {
          const Vector2d from = view_.At(wall->solid.At(hole->min().x(), behind_m));
          const Vector2d to = view_.At(wall->solid.At(hole->max().x(), behind_m));
          if (!is_on(from) || !is_on(to)) continue;
          const auto [left_m, right_m] = std::minmax(from.x(), to.x());
          holes.emplace_back(Vector2d(left_m, hole->min().y()), Vector2d(right_m, hole->max().y()));
        }
      }
    }
    std::sort(holes.begin(), holes.end(), [](const AlignedBox2d& a, const AlignedBox2d& b) {
      return a.min().x() < b.min().x();
    });
    return holes;
  }

  const SectionView& view_;
  const std::vector<TallWall>& walls_;
  std::vector<ViewedLine> lines_;
  std::vector<Screen> screens_;
  std::vector<std::pair<SectionOpening, double>> openings_;  // with the depth of their middle
  AlignedBox2d extent_;
};

}  // namespace

SectionShape ShapeOfSection(const MapResult& map, const SectionView& view) {
  const std::vector<TallWall> walls = TallWalls(map.building, view);
  SectionShape shape;
  shape.cut = CutOf(map.building, walls, view);
  BeyondCut beyond(view, walls);
  beyond.AddWalls();
  for (const MapLine& line : map.lines) {
    beyond.AddLine(map.building.T_map_world * line.start_world,
                   map.building.T_map_world * line.end_world);
  }
  shape.extent = beyond.extent();
  for (const CutBox& cut : shape.cut.boxes) {
    beyond.Hide(cut.box);
    shape.extent.extend(cut.box);
  }
  if (shape.extent.isEmpty()) return shape;
  shape.drawing = DrawCut(shape.cut.boxes);
  Append(beyond.Paths(shape.extent), &shape.drawing.paths);
  Append(beyond.Openings(), &shape.cut.openings);
  return shape;
}

}  // namespace slcmap
