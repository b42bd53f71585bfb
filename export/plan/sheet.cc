#include "export/plan/sheet.h"

#include <spdlog/fmt/fmt.h>

#include "export/plan/legend.h"
#include "export/plan/storey_plan.h"
#include "export/world_offset.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;

constexpr double kTitle_mm = 5, kNote_mm = 2;

DrawnPath Frame(const Vector2d& low, const Vector2d& high) {
  return {Pen::kFrame, {low, {high.x(), low.y()}, high, {low.x(), high.y()}, low}};
}

Drawing PlanInMetres(const StoreyPlan& plan, const PlanTextSizes& sizes) {
  Drawing drawing = plan.rooms;
  drawing.Add(plan.walls);
  drawing.Add(plan.openings);
  for (const Dimension& dimension : plan.dimensions) {
    drawing.Add(DrawDimension(dimension, sizes));
  }
  drawing.Add({{}, {}, plan.room_texts});
  drawing.Add({{}, {}, plan.wall_texts});
  return drawing;
}

// Title and notes, from the top of the title block down.
std::vector<DrawnText> TitleTexts(const std::string& title, const std::vector<std::string>& notes) {
  constexpr double kLeft_mm = kSheetBorder_mm + 5, kLine_mm = 4;
  double base_mm = kSheetBorder_mm + kTitleBlock_mm - 4 - kTitle_mm;
  std::vector<DrawnText> texts = {{title, {kLeft_mm, base_mm}, kTitle_mm, 0, Align::kLeft}};
  base_mm -= 1.5;
  for (const std::string& note : notes) {
    base_mm -= kLine_mm;
    texts.push_back({note, {kLeft_mm, base_mm}, kNote_mm, 0, Align::kLeft});
  }
  return texts;
}

std::vector<std::string> Notes(const MapResult& map, const SheetFormat& format) {
  std::vector<std::string> notes = {fmt::format("Floor plan 1:{} on {}", format.scale, format.name),
                                    "Metres, clear between measured faces"};
  if (!map.id.empty()) notes.push_back("Map " + map.id);
  const std::string offset = WorldOffsetNote(map.source.world_offset_m);
  if (!offset.empty()) notes.push_back(offset);
  if (!map.complete) notes.push_back("Partial: not all was mapped");
  return notes;
}

// Everything but the plan itself.
Drawing Blank(const MapResult& map, const SheetFormat& format, const std::string& title) {
  constexpr double kLegendLeft_mm = 88, kBarFromRight_mm = 72, kLow_mm = 4;
  const Vector2d low = Vector2d::Constant(kSheetBorder_mm);
  const Vector2d high = format.size_mm - low;
  Drawing drawing;
  drawing.paths = {Frame(low, high), Frame(low, {high.x(), low.y() + kTitleBlock_mm})};
  drawing.texts = TitleTexts(title, Notes(map, format));
  drawing.Add(Placed(Legend(), 1, low + Vector2d(kLegendLeft_mm, kLow_mm)));
  drawing.Add(Placed(ScaleBar(format.scale), 1, {high.x() - kBarFromRight_mm, low.y() + kLow_mm}));
  return drawing;
}

Sheet EmptySheet(const MapResult& map, const SheetFormat& format) {
  Sheet sheet = {"no_storey", "No storey", format.size_mm, {}};
  sheet.drawing = Blank(map, format, sheet.title);
  const char* const lines[] = {"This map holds no storey: it was made without images,",
                               "or no floor and no walls were found in it."};
  double base_mm = 0.5 * format.size_mm.y();
  for (const char* line : lines) {
    sheet.drawing.texts.push_back({line, {0.5 * format.size_mm.x(), base_mm}, 3});
    base_mm -= 7;
  }
  return sheet;
}

Sheet SheetOf(const MapResult& map, const PlanSet& plans, const StoreyPlan& plan) {
  Sheet sheet = {fmt::format("storey_{}", plan.storey.id),
                 fmt::format("Storey {}", plan.storey.id),
                 plans.format.size_mm,
                 {}};
  const double mm_of_metre = 1000.0 / plans.format.scale;
  sheet.drawing = Placed(PlanInMetres(plan, PlanTextSizes(plans.format.scale)), mm_of_metre,
                         plans.format.Middle_mm() - mm_of_metre * plans.middle_m);
  sheet.drawing.Add(Blank(map, plans.format, sheet.title));
  return sheet;
}

}  // namespace

std::vector<Sheet> MakeSheets(const MapResult& map, const PlanOptions& options) {
  const PlanSet plans = MakePlans(map.building, options);
  if (plans.storeys.empty()) return {EmptySheet(map, plans.format)};
  std::vector<Sheet> sheets;
  for (const StoreyPlan& plan : plans.storeys) sheets.push_back(SheetOf(map, plans, plan));
  return sheets;
}

}  // namespace slcmap
