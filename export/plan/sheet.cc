#include "export/plan/sheet.h"

#include <spdlog/fmt/fmt.h>

#include "export/plan/legend.h"
#include "export/plan/storey_plan.h"
#include "export/plan/title_block.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;

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

Sheet SheetOf(const TitleBlock& block, const PlanSet& plans, const StoreyPlan& plan, bool in_mm) {
  Sheet sheet = {fmt::format("storey_{}", plan.storey.id),
                 fmt::format("Storey {}", plan.storey.id),
                 block.project(),
                 plans.format.size_mm,
                 {}};
  const double mm_of_metre = 1000.0 / plans.format.scale;
  const PlanTextSizes sizes(plans.format.scale, in_mm);
  sheet.drawing = Placed(PlanInMetres(plan, sizes), mm_of_metre,
                         plans.format.Middle_mm() - mm_of_metre * plans.middle_m);
  if (plan.walls.paths.empty()) {
    Append(MiddleTexts(plans.format, {"No wall was found on this storey."}), &sheet.drawing.texts);
  }
  sheet.drawing.Add(block.Draw(
      plans.format, {sheet.title, "Floor plan", fmt::format("S{}", plan.storey.id)}, Legend()));
  return sheet;
}

}  // namespace

std::string TitleOf(const Sheet& sheet) {
  return sheet.project.empty() ? sheet.title : sheet.project + ", " + sheet.title;
}

std::vector<Sheet> MakeSheets(const MapResult& map, const PlanOptions& options) {
  const PlanSet plans = MakePlans(map.building, options);
  const TitleBlock block(map, options);
  if (plans.storeys.empty()) return {EmptySheet(block, plans.format)};
  std::vector<Sheet> sheets;
  for (const StoreyPlan& plan : plans.storeys) {
    sheets.push_back(SheetOf(block, plans, plan, options.millimetres));
  }
  return sheets;
}

}  // namespace slcmap
