#include "export/plan/section_drawing.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "export/plan/drawing.h"
#include "mapping/map/map.h"

namespace slcmap::inline exporting {

namespace {

using Eigen::AlignedBox2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kSameFace_m = 2e-3;

// What a section or an elevation shows: what is cut, and what is seen beyond. Metres: x as the view
// says, y the height in world.

struct SectionShape {
  Drawing drawing;             // areas of what is cut, paths of its borders and of what is beyond
  Eigen::AlignedBox2d extent;  // of walls, floors and ceilings; empty where there is nothing
  SectionCut cut;              // its openings are also those that are seen beyond
};

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
    std::vector<Polygon> pieces;
    std::vector<WallSolid> solids;
    for (const TallWall* wall : walls) {
      solids.push_back(wall->solid);
      pieces.push_back(MakePiece(wall->solid, 0, wall->solid.Length()));
    }
    for (const Polygon& area : Union(pieces, kOutlineGrid_m)) {
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

// Walls beyond the cut with their openings, and the lines of the map there, as far as other walls
// do not hide them.
SectionShape ShapeOfSection(const MapResult& map, const SectionView& view) {
  const std::vector<TallWall> walls = TallWalls(map.building, view);
  SectionShape shape;
  shape.cut = MakeCut(map.building, walls, view);
  BeyondCut beyond(view, walls);
  beyond.AddWalls();
  for (const MapLine& line : map.lines) beyond.AddLine(line.start_world, line.end_world);
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

// Floors and ceilings that a view shows, each once, from the lowest.
std::vector<double> CollectLevels(const Building& building, const SectionView& view) {
  constexpr double kSame_m = 1e-3;
  std::vector<double> levels;
  for (const Storey& storey : building.storeys) {
    if (!view.Shows(storey.id)) continue;
    levels.push_back(storey.floor_m);
    if (storey.ceiling_m) levels.push_back(*storey.ceiling_m);
  }
  std::sort(levels.begin(), levels.end());
  const auto last = std::unique(levels.begin(), levels.end(),
                                [](double a, double b) { return std::abs(a - b) < kSame_m; });
  levels.erase(last, levels.end());
  return levels;
}

class SectionTexts {
 public:
  SectionTexts(const Building& building, const SectionCut& cut, const PlanTextSizes& sizes,
               SectionDrawing* drawing)
      : building_(building), cut_(cut), sizes_(sizes), drawing_(*drawing) {}

  void AddAll() {
    for (const CutBox& cut : cut_.boxes) {
      const double half_m = 0.5 * cut.box.sizes().y();
      const Vector2d middle = cut.box.center();
      taken_.AddWall(MakeBox(Vector2d(cut.box.min().x(), middle.y()),
                             Vector2d(cut.box.max().x(), middle.y()), half_m));
    }
    for (const CutRoom& room : cut_.rooms) AddRoom(room);
    for (const SectionOpening& opening : cut_.openings) {
      if (opening.is_cut) {
        AddCutOpening(opening);
      } else {
        AddSeenOpening(opening);
      }
    }
    AddLevels();
    AddChain();
  }

 private:
  // The clear height, not where a text would stand on what is there already.
  void AddCutOpening(const SectionOpening& opening) {
    const double middle_m = opening.box.center().x();
    AddInner({middle_m, opening.box.min().y()}, {middle_m, opening.box.max().y()}, false);
  }

  void AddSeenOpening(const SectionOpening& opening) {
    const std::string text = OpeningText(*opening.opening, sizes_.in_mm);
    const Vector2d size = opening.box.sizes();
    const double text_m = TextWidth(text, sizes_.small_m);
    if (text_m > size.maxCoeff()) return;
    const double angle_rad = text_m > size.x() ? M_PI / 2 : 0;
    const Vector2d up(-std::sin(angle_rad), std::cos(angle_rad));
    for (const double share : {0.5, 0.65, 0.8, 0.35, 0.2}) {
      const Vector2d middle(opening.box.center().x(), opening.box.min().y() + share * size.y());
      const DrawnText placed = {text, middle - 0.5 * sizes_.small_m * up, sizes_.small_m,
                                angle_rad};
      if (!taken_.HasRoomForText(MakeBox(placed))) continue;
      taken_.AddText(MakeBox(placed));
      drawing_.texts.push_back(placed);
      return;
    }
  }

  // Clear width and height, and the name over the width.
  void AddRoom(const CutRoom& cut) {
    constexpr double kWidthAt = 0.4, kHeightAt = 0.15;  // shares of height and width
    const Room& room = *cut.room;
    const double height_m = room.height_m.value_or(2.5);
    const double level_m = room.floor_m + kWidthAt * height_m;
    const bool is_about = !IsSeen(room, cut.from_m) || !IsSeen(room, cut.to_m);
    AddInner({cut.from_m, level_m}, {cut.to_m, level_m}, is_about);
    if (room.height_m) {
      const double at_m = cut.from_m + kHeightAt * (cut.to_m - cut.from_m);
      AddInner({at_m, room.floor_m}, {at_m, room.floor_m + height_m}, false);
    }
    const double middle_m = 0.5 * (cut.from_m + cut.to_m);
    const DrawnText name = {GetTitle(room),
                            {middle_m, level_m + 2 * sizes_.gap_m + 1.5 * sizes_.figure_m},
                            sizes_.figure_m};
    if (!taken_.HasRoomForText(MakeBox(name))) return;
    taken_.AddText(MakeBox(name));
    drawing_.texts.push_back(name);
  }

  // Whether a side of a wall that was seen is there.
  bool IsSeen(const Room& room, double at_m) const {
    constexpr double kNear_m = 5e-3;
    return std::any_of(cut_.walls.begin(), cut_.walls.end(), [&](const CutWall& wall) {
      const Eigen::AlignedBox2d& box = wall.cut.box;
      return wall.wall->storey == room.storey &&
             ((!wall.cut.assumed_sides[0] && std::abs(box.min().x() - at_m) < kNear_m) ||
              (!wall.cut.assumed_sides[1] && std::abs(box.max().x() - at_m) < kNear_m));
    });
  }

  // Where it is longer than its text, and the text has room.
  void AddInner(const Vector2d& from, const Vector2d& to, bool is_about) {
    Dimension dimension;
    dimension.from = from;
    dimension.to = to;
    dimension.is_about = is_about;
    dimension.in_mm = sizes_.in_mm;
    const double length_m = dimension.Length();
    if (TextWidth(dimension.Text(), sizes_.figure_m) > length_m) return;
    for (const double share : {0.5, 0.3, 0.7}) {
      dimension.text_at = share;
      const Box text = MakeBox(DimensionText(dimension, sizes_));
      if (!taken_.HasRoomForText(text)) continue;
      taken_.AddText(text);
      taken_.AddLine(MakeBox(from, to, sizes_.gap_m));
      drawing_.dimensions.push_back(dimension);
      return;
    }
  }

  // Heights over the lowest floor at the right, and as a chain at the left.
  void AddLevels() {
    if (building_.storeys.empty()) return;
    const double zero_m = building_.storeys.front().floor_m;
    const double right_m = drawing_.extent.max().x();
    std::vector<ChainMark> marks;
    double free_m = -1e9;
    for (const double level_m : CollectLevels(building_, drawing_.view)) {
      marks.push_back({level_m});
      if (level_m < free_m) continue;
      free_m = level_m + sizes_.figure_m + 2 * sizes_.gap_m;
      const double shown_m = std::abs(level_m - zero_m) < 5e-4 ? 0 : level_m - zero_m;
      const std::string text =
          sizes_.in_mm ? fmt::format("{:+.0f}", 1e3 * shown_m) : fmt::format("{:+.2f}", shown_m);
      const double from_m = right_m + sizes_.gap_m;
      drawing_.texts.push_back(
          {text, {from_m, level_m + sizes_.gap_m}, sizes_.figure_m, 0, Align::kLeft});
      drawing_.marks.push_back(
          {Pen::kDimension,
           {{from_m, level_m}, {from_m + TextWidth(text, sizes_.figure_m), level_m}}});
    }
    Append(ChainsOutside({1, false}, drawing_.extent, marks, sizes_), &drawing_.dimensions);
  }

  // Of the walls of the lowest storey that are cut, else of all that is seen.
  void AddChain() {
    std::vector<ChainMark> marks;
    for (const CutWall& wall : cut_.walls) {
      const CutWall& lowest = cut_.walls.front();
      if (wall.wall->storey != lowest.wall->storey) continue;
      const Eigen::AlignedBox2d& box = wall.cut.box;
      const double weight_m = (wall.wall->end - wall.wall->start).norm();
      marks.push_back({box.min().x(), weight_m, wall.wall, wall.cut.assumed_sides[0]});
      marks.push_back({box.max().x(), weight_m, wall.wall, wall.cut.assumed_sides[1]});
    }
    if (marks.empty()) {
      marks = {{drawing_.extent.min().x(), 0, nullptr, true},
               {drawing_.extent.max().x(), 0, nullptr, true}};
    }
    Append(ChainsOutside({0, false}, drawing_.extent, marks, sizes_), &drawing_.dimensions);
  }

  const Building& building_;
  const SectionCut& cut_;
  const PlanTextSizes& sizes_;
  SectionDrawing& drawing_;
  TakenPlaces taken_;
};

}  // namespace

std::vector<SectionDrawing> MakeSections(const MapResult& map, const PlanOptions& options) {
  std::vector<SectionDrawing> drawings;
  for (const SectionView& view : SectionViews(map.building, options)) {
    SectionShape shape = ShapeOfSection(map, view);
    if (shape.extent.isEmpty()) continue;
    SectionDrawing drawing;
    drawing.view = view;
    drawing.format = ChooseFormat(shape.extent.sizes(), options);
    drawing.extent = shape.extent;
    drawing.shape = std::move(shape.drawing);
    const PlanTextSizes sizes(drawing.format.scale, options.millimetres);
    SectionTexts(map.building, shape.cut, sizes, &drawing).AddAll();
    drawings.push_back(std::move(drawing));
  }
  return drawings;
}

}  // namespace slcmap::exporting
