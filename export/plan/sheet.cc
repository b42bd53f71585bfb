#include "export/plan/sheet.h"

#include <spdlog/fmt/fmt.h>

#include <ctime>
#include <filesystem>

#include "export/plan/legend.h"
#include "export/plan/storey_plan.h"
#include "export/world_offset.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;

constexpr double kTitle_mm = 4, kNote_mm = 2;

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
  constexpr double kLeft_mm = kSheetBorder_mm + 4, kLine_mm = 4;
  double base_mm = kSheetBorder_mm + kTitleBlock_mm - 3 - kTitle_mm;
  std::vector<DrawnText> texts = {{title, {kLeft_mm, base_mm}, kTitle_mm, 0, Align::kLeft}};
  base_mm -= 1;
  for (const std::string& note : notes) {
    base_mm -= kLine_mm;
    texts.push_back({note, {kLeft_mm, base_mm}, kNote_mm, 0, Align::kLeft});
  }
  return texts;
}

// The recording's name; "" where the map does not say it.
std::string ProjectOf(const MapResult& map) {
  std::filesystem::path path = std::filesystem::path(map.source.sequence).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  return (path.filename() == "mav0" ? path.parent_path() : path).filename().string();
}

// The day of the first image, UTC, where its stamps are since 1970 and not from a start of their
// own; "" else. The clock of the machine would give other bytes each day.
std::string DateOf(const MapResult& map) {
  constexpr int64_t kYear2000_s = 946684800, kYear2100_s = 4102444800;
  if (map.trajectory.empty()) return "";
  const std::time_t stamp_s = map.trajectory.front().stamp_ns / 1000000000;
  if (stamp_s < kYear2000_s || stamp_s > kYear2100_s) return "";
  std::tm utc{};
  gmtime_r(&stamp_s, &utc);
  return fmt::format("{:04}-{:02}-{:02}", utc.tm_year + 1900, utc.tm_mon + 1, utc.tm_mday);
}

// What is written around the plans of a map.
struct TitleBlock {
  TitleBlock(const MapResult& map, const PlanOptions& options)
      : project(options.project.empty() ? ProjectOf(map) : options.project),
        date(options.date.empty() ? DateOf(map) : options.date),
        number(options.number.empty() ? map.id.substr(0, 8) : options.number),
        map_id(map.id),
        offset(WorldOffsetNote(map.source.world_offset_m)),
        is_complete(map.complete),
        in_mm(options.millimetres),
        north_deg(options.north_deg) {}

  std::vector<std::string> Notes(const SheetFormat& format, const std::string& sheet) const {
    std::vector<std::string> notes = {
        fmt::format("{}, {}", project.empty() ? "Project not named" : project,
                    date.empty() ? "date not known" : date),
        fmt::format("Floor plan 1:{} on {}, drawing {}{}", format.scale, format.name,
                    number.empty() ? "" : number + "-", sheet),
        in_mm ? "Millimetres, clear between measured faces"
              : "Metres, clear between measured faces",
        "~, about: a border was not seen, a thickness assumed"};
    if (!offset.empty()) notes.push_back(offset);
    const std::string partial = is_complete ? "" : "Partial: not all was mapped. ";
    if (!is_complete || !map_id.empty()) notes.push_back(fmt::format("{}Map {}", partial, map_id));
    return notes;
  }

  std::string project, date, number, map_id, offset;
  bool is_complete, in_mm;
  std::optional<double> north_deg;
};

// Everything but the plan itself. `sheet` is its part of the drawing's number.
Drawing Blank(const TitleBlock& block, const SheetFormat& format, const std::string& title,
              const std::string& sheet) {
  constexpr double kLegendLeft_mm = 90, kBarFromRight_mm = 72, kLow_mm = 4, kArrow_mm = 13;
  const Vector2d low = Vector2d::Constant(kSheetBorder_mm);
  const Vector2d high = format.size_mm - low;
  const double right_mm = high.x() - kBarFromRight_mm;
  Drawing drawing;
  drawing.paths = {Frame(low, high), Frame(low, {high.x(), low.y() + kTitleBlock_mm})};
  drawing.texts = TitleTexts(title, block.Notes(format, sheet));
  drawing.Add(Placed(Legend(), 1, low + Vector2d(kLegendLeft_mm, kLow_mm)));
  drawing.Add(Placed(ScaleBar(format.scale), 1, {right_mm, low.y() + kLow_mm}));
  drawing.Add(Placed(NorthArrow(block.north_deg), 1, {right_mm, low.y() + kArrow_mm}));
  return drawing;
}

Sheet EmptySheet(const TitleBlock& block, const SheetFormat& format) {
  Sheet sheet = {"no_storey", "No storey", block.project, format.size_mm, {}};
  sheet.drawing = Blank(block, format, sheet.title, "S");
  const char* const lines[] = {"This map holds no storey: it was made without images,",
                               "or no floor and no walls were found in it."};
  double base_mm = 0.5 * format.size_mm.y();
  for (const char* line : lines) {
    sheet.drawing.texts.push_back({line, {0.5 * format.size_mm.x(), base_mm}, 3});
    base_mm -= 7;
  }
  return sheet;
}

Sheet SheetOf(const TitleBlock& block, const PlanSet& plans, const StoreyPlan& plan) {
  Sheet sheet = {fmt::format("storey_{}", plan.storey.id),
                 fmt::format("Storey {}", plan.storey.id),
                 block.project,
                 plans.format.size_mm,
                 {}};
  const double mm_of_metre = 1000.0 / plans.format.scale;
  const PlanTextSizes sizes(plans.format.scale, block.in_mm);
  sheet.drawing = Placed(PlanInMetres(plan, sizes), mm_of_metre,
                         plans.format.Middle_mm() - mm_of_metre * plans.middle_m);
  sheet.drawing.Add(Blank(block, plans.format, sheet.title, fmt::format("S{}", plan.storey.id)));
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
  for (const StoreyPlan& plan : plans.storeys) sheets.push_back(SheetOf(block, plans, plan));
  return sheets;
}

}  // namespace slcmap
