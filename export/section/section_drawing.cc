#include "export/section/section_drawing.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "export/plan/opening_symbols.h"
#include "export/plan/room_label.h"
#include "export/plan/taken_places.h"
#include "export/section/section_shape.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;

// Floors and ceilings that a view shows, each once, from the lowest.
std::vector<double> LevelsOf(const Building& building, const SectionView& view) {
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
    const DrawnText name = {NameOf(room),
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
    for (const double level_m : LevelsOf(building_, drawing_.view)) {
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

}  // namespace slcmap
