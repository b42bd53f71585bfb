#include "export/plan/sheet.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "data/core/error.h"
#include "export/plan/plan_deviations.h"
#include "export/plan/section_drawing.h"
#include "export/plan/storey_plan.h"
#include "export/plan/title_block.h"

namespace slcmap::inline exporting {
namespace {

using Eigen::Vector2d;

struct Paper {
  const char* name;
  double width_mm, height_mm;
};
constexpr std::array<Paper, 5> kPapers = {
    {{"A4", 297, 210}, {"A3", 420, 297}, {"A2", 594, 420}, {"A1", 841, 594}, {"A0", 1189, 841}}};
constexpr size_t kA2 = 2, kA0 = 4;

// What the chains of dimensions take at each side, and clear space around them.
constexpr double kChains_mm = 18, kClear_mm = 3;

SheetFormat MakeSheetFormat(const Paper& paper, int scale) {
  return {scale, paper.name, {paper.width_mm, paper.height_mm}};
}

std::optional<SheetFormat> Smallest(const Vector2d& extent_m, int scale, size_t largest) {
  const Vector2d needed_mm =
      extent_m * 1000 / scale + Vector2d::Constant(2 * (kChains_mm + kClear_mm));
  for (size_t i = 0; i <= largest; ++i) {
    const SheetFormat format = MakeSheetFormat(kPapers[i], scale);
    if ((needed_mm.array() <= format.Area_mm().array()).all()) return format;
  }
  return std::nullopt;
}

// The first of 1:100, 1:200, 1:500, 1:1000, ... that a sheet holds.
SheetFormat Chosen(const Vector2d& extent_m) {
  for (int tens = 100;; tens *= 10) {
    for (const int step : {1, 2, 5}) {
      if (const auto format = Smallest(extent_m, step * tens, kA0)) return *format;
    }
  }
}

}  // namespace

Vector2d SheetFormat::Corner_mm() const {
  return {kSheetBorder_mm, kSheetBorder_mm + kTitleBlock_mm};
}

Vector2d SheetFormat::Area_mm() const {
  return size_mm - Corner_mm() - Vector2d::Constant(kSheetBorder_mm);
}

Vector2d SheetFormat::Middle_mm() const { return Corner_mm() + 0.5 * Area_mm(); }

SheetFormat ChooseFormat(const Vector2d& extent_m, const PlanOptions& options) {
  options.Check();
  constexpr double kMost_m = 1e6;
  if (!(extent_m.array() <= kMost_m).all()) {
    throw DataError(fmt::format("plan: found a building of {} m by {} m, expected at most {} m",
                                extent_m.x(), extent_m.y(), kMost_m));
  }
  if (options.scale > 0) {
    if (const auto format = Smallest(extent_m, options.scale, kA0)) return *format;
    throw ConfigError(fmt::format("plan scale: found 1:{}, which A0 does not hold, expected 1:{}",
                                  options.scale, Chosen(extent_m).scale));
  }
  if (const auto format = Smallest(extent_m, 50, kA2)) return *format;
  return Chosen(extent_m);
}

namespace {

Drawing PlanInMetres(const StoreyPlan& plan, const PlanTextSizes& sizes) {
  Drawing drawing = plan.rooms;
  drawing.Add(plan.walls);
  drawing.Add(plan.openings);
  drawing.Add(plan.sections);
  for (const Dimension& dimension : plan.dimensions) {
    drawing.Add(DrawDimension(dimension, sizes));
  }
  drawing.Add({{}, {}, plan.room_texts});
  drawing.Add({{}, {}, plan.wall_texts});
  return drawing;
}

// Lines in the middle of a sheet on which there would be nothing else.
std::vector<DrawnText> MiddleTexts(const SheetFormat& format,
                                   const std::vector<std::string>& lines) {
  std::vector<DrawnText> texts;
  double base_mm = 0.5 * format.size_mm.y();
  for (const std::string& line : lines) {
    texts.push_back({line, {0.5 * format.size_mm.x(), base_mm}, 3});
    base_mm -= 7;
  }
  return texts;
}

Sheet EmptySheet(const TitleBlock& block, const SheetFormat& format) {
  Sheet sheet = {"no_storey", "No storey", block.project(), format.size_mm, {}};
  sheet.drawing = block.Draw(format, {sheet.title, "Floor plan", "S"}, Legend());
  Append(MiddleTexts(format, {"This map holds no storey: it was made without images,",
                              "or no floor and no walls were found in it."}),
         &sheet.drawing.texts);
  return sheet;
}

Sheet MakeSheet(const TitleBlock& block, const MapResult& map, const PlanSet& plans,
                const StoreyPlan& plan, bool in_mm) {
  Sheet sheet = {fmt::format("storey_{}", plan.storey.id),
                 GetTitle(plan.storey),
                 block.project(),
                 plans.format.size_mm,
                 {}};
  const double mm_of_metre = 1000.0 / plans.format.scale;
  const PlanTextSizes sizes(plans.format.scale, in_mm);
  Drawing in_metres = PlanInMetres(plan, sizes);
  in_metres.Add(DrawPlanDeviations(map, plan.storey, sizes));
  sheet.drawing =
      Placed(in_metres, mm_of_metre, plans.format.Middle_mm() - mm_of_metre * plans.middle_m);
  if (plan.walls.paths.empty()) {
    Append(MiddleTexts(plans.format, {"No wall was found on this storey."}), &sheet.drawing.texts);
  }
  sheet.drawing.Add(block.Draw(
      plans.format, {sheet.title, "Floor plan", fmt::format("S{}", plan.storey.id)}, Legend()));
  return sheet;
}

}  // namespace

std::string FormatTitle(const Sheet& sheet) {
  return sheet.project.empty() ? sheet.title : sheet.project + ", " + sheet.title;
}

std::vector<Sheet> MakeSheets(const MapResult& map, const PlanOptions& options) {
  const PlanSet plans = MakePlans(map.building, options);
  const TitleBlock block(map, options);
  if (plans.storeys.empty()) return {EmptySheet(block, plans.format)};
  std::vector<Sheet> sheets;
  for (const StoreyPlan& plan : plans.storeys) {
    sheets.push_back(MakeSheet(block, map, plans, plan, options.millimetres));
  }
  return sheets;
}

std::vector<Sheet> MakeSectionSheets(const MapResult& map, const PlanOptions& options) {
  const TitleBlock block(map, options);
  std::vector<Sheet> sheets;
  for (const SectionDrawing& section : MakeSections(map, options)) {
    const SheetFormat& format = section.format;
    const PlanTextSizes sizes(format.scale, options.millimetres);
    Drawing in_metres = section.shape;
    Append(section.marks, &in_metres.paths);
    Append(section.texts, &in_metres.texts);
    for (const Dimension& dimension : section.dimensions) {
      in_metres.Add(DrawDimension(dimension, sizes));
    }
    const double mm_of_metre = 1000.0 / format.scale;
    const SectionView& view = section.view;
    Sheet sheet = {
        view.name, view.title, block.project(), format.size_mm,
        Placed(in_metres, mm_of_metre, format.Middle_mm() - mm_of_metre * section.extent.center())};
    sheet.drawing.Add(block.Draw(format,
                                 {view.title,
                                  view.mark.empty() ? "Elevation" : "Section",
                                  view.name,
                                  {view.place, "heights over the lowest floor"}},
                                 SectionLegend()));
    sheets.push_back(std::move(sheet));
  }
  return sheets;
}

}  // namespace slcmap::exporting
