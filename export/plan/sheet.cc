#include "export/plan/sheet.h"

#include <spdlog/fmt/chrono.h>
#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <optional>
#include <tuple>

#include "data/core/error.h"
#include "export/plan/drawing.h"
#include "export/plan/section_drawing.h"
#include "export/scene/building_solids.h"
#include "export/scene/georeference_note.h"

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

// What explains a plan on its sheet: title block, legend, arrow to the north, scale bar.

constexpr double kSample_mm = 14, kThickness_mm = 2, kRow_mm = 6, kColumn_mm = 55;
constexpr double kText_mm = 1.8;

// A short wall, whose "metres" are millimetres here.
PlanWall SampleWall(bool is_assumed) {
  PlanWall wall;
  wall.start = {kSample_mm, 0};  // so that it is below its face
  wall.thickness_m = kThickness_mm;
  wall.thickness_assumed = is_assumed;
  return wall;
}

PlanWall SampleOpening(OpeningKind kind, bool is_walked) {
  PlanWall wall = SampleWall(false);
  PlanOpening opening;
  opening.kind = kind;
  opening.walked = is_walked;
  opening.from_m = 5.2;
  opening.to_m = 8.8;
  wall.openings = {opening};
  return wall;
}

void AddText(const char* text, Drawing* drawing) {
  drawing->texts.push_back(
      {text, {kSample_mm + 2, -0.5 * (kThickness_mm + kText_mm)}, kText_mm, 0, Align::kLeft});
}

struct Sample {
  const char* text;
  PlanWall wall;
};

Drawing DrawSample(const Sample& sample) {
  Building building;
  building.walls = {sample.wall};
  const std::vector<WallSolid> solids = WallSolids(building, 0);
  Drawing drawing = DrawWalls(solids);
  for (const PlanOpening& opening : sample.wall.openings) {
    drawing.Add(OpeningSymbol(solids.front(), opening));
  }
  AddText(sample.text, &drawing);
  return drawing;
}

Drawing DrawLineSample(Pen pen, const char* text) {
  const double middle_mm = -0.5 * kThickness_mm;
  Drawing drawing;
  drawing.paths = {{pen, {{0, middle_mm}, {kSample_mm, middle_mm}}}};
  AddText(text, &drawing);
  return drawing;
}

Drawing DrawNumberSample() {
  Drawing drawing;
  drawing.texts = {{"W3 0.15", {0.5 * kSample_mm, -0.5 * (kThickness_mm + kText_mm)}, kText_mm}};
  AddText("wall 3 and its thickness", &drawing);
  return drawing;
}

Drawing InColumns(const std::vector<Drawing>& samples) {
  constexpr int kRows = 4;
  Drawing legend;
  for (int i = 0; i < static_cast<int>(samples.size()); ++i) {
    const Vector2d place(kColumn_mm * (i / kRows),
                         kRow_mm * (kRows - 1 - i % kRows) + kThickness_mm);
    legend.Add(Placed(samples[static_cast<size_t>(i)], 1, place));
  }
  return legend;
}

// The round length, of 1, 2 or 5 times a power of ten, that comes nearest below.
double RoundBelow(double length_m) {
  const double ten = std::pow(10, std::floor(std::log10(length_m)));
  for (const double step : {5, 2}) {
    if (step * ten <= length_m) return step * ten;
  }
  return ten;
}

// Samples of walls and openings with their names, in two columns, 110 mm by 23 mm. Millimetres from
// its lower left corner.
Drawing Legend() {
  const Sample samples[] = {
      {"wall, measured on both sides", SampleWall(false)},
      {"wall, thickness assumed", SampleWall(true)},
      {"door, walked through", SampleOpening(OpeningKind::kDoor, true)},
      {"door, seen through", SampleOpening(OpeningKind::kDoor, false)},
      {"window", SampleOpening(OpeningKind::kWindow, false)},
      {"passage", SampleOpening(OpeningKind::kPassage, false)},
  };
  std::vector<Drawing> drawn;
  for (const Sample& sample : samples) drawn.push_back(DrawSample(sample));
  drawn.push_back(DrawLineSample(Pen::kRoom, "border of a room, no wall seen"));
  drawn.push_back(DrawNumberSample());
  return InColumns(drawn);
}

// The same of what sections show.
Drawing SectionLegend() {
  const auto area = [](bool is_assumed, const char* text) {
    return DrawSample({text, SampleWall(is_assumed)});
  };
  const auto line = [](Pen pen, const char* text) { return DrawLineSample(pen, text); };
  return InColumns(
      {area(false, "cut, measured"), area(true, "cut, thickness assumed"),
       line(Pen::kBeyond, "edge of a wall beyond"), line(Pen::kAssumed, "edge that was not seen"),
       line(Pen::kOpening, "border of an opening"), line(Pen::kLine, "line of the map, beyond")});
}

// An arrow and what it points to, some 14 mm high, from its lower left corner: the compass' north,
// that many degrees clockwise from up, known `by` that, or where it is not known, up: along the
// building's walls, or along what `by` says.
Drawing NorthArrow(const std::optional<double>& north_deg, const std::string& by) {
  constexpr double kReach_mm = 6, kHalf_mm = 1.8;
  const Eigen::Rotation2Dd turn(-north_deg.value_or(0) * M_PI / 180);
  const Vector2d middle(kReach_mm, kReach_mm + 1);
  const auto at = [&](double x, double y) { return Vector2d(middle + turn * Vector2d(x, y)); };
  const Vector2d tip = at(0, kReach_mm), tail = at(0, -kReach_mm), neck = at(0, 1);
  Drawing arrow;
  arrow.areas = {{Fill::kInk, {{tip, at(-kHalf_mm, 0), neck}, {}}}};
  arrow.paths = {{Pen::kDimension, {tail, neck}}, {Pen::kDimension, {neck, at(kHalf_mm, 0), tip}}};
  std::array<std::string, 2> lines = {"Building north: up on this sheet, along",
                                      "the walls; the compass' north is not known"};
  if (north_deg) {
    lines = {fmt::format("North: {:.4g}\u00b0 clockwise from up,", *north_deg), by};
  } else if (!by.empty()) {
    lines = {"Up on this sheet: " + by + ";", "the compass' north is not known"};
  }
  double base_mm = middle.y() + 0.5;
  for (const std::string& line : lines) {
    arrow.texts.push_back({line, {2 * kReach_mm + 2, base_mm}, kText_mm, 0, Align::kLeft});
    base_mm -= 3.4;
  }
  return arrow;
}

// Metres at a scale, some 50 mm long.
Drawing ScaleBar(int scale) {
  constexpr double kLongest_mm = 60, kHeight_mm = 1.6;
  constexpr int kParts = 5;
  const double length_m = RoundBelow(kLongest_mm * 1e-3 * scale);
  const double part_mm = length_m * 1e3 / scale / kParts;
  Drawing bar;
  for (int i = 0; i < kParts; ++i) {
    const double from = i * part_mm, to = from + part_mm;
    const PlanPoints outline = {{from, 0}, {to, 0}, {to, kHeight_mm}, {from, kHeight_mm}};
    if (i % 2 == 0) bar.areas.push_back({Fill::kInk, {outline, {}}});
    PlanPoints border = outline;
    border.push_back(outline.front());
    bar.paths.push_back({Pen::kDimension, border});
  }
  for (const int i : {0, kParts}) {
    const std::string text = fmt::format("{:g}{}", length_m * i / kParts, i == 0 ? "" : " m");
    bar.texts.push_back({text, {i * part_mm, kHeight_mm + 1}, kText_mm});
  }
  return bar;
}

constexpr double kTitle_mm = 4, kNote_mm = 2, kLine_mm = 4;

DrawnPath Frame(const Vector2d& low, const Vector2d& high) {
  return {Pen::kFrame, {low, {high.x(), low.y()}, high, {low.x(), high.y()}, low}};
}

// Title and notes, from the top of the title block down.
std::vector<DrawnText> TitleTexts(const std::string& title, const std::vector<std::string>& notes) {
  constexpr double kLeft_mm = kSheetBorder_mm + 4, kLowest_mm = kSheetBorder_mm + 2;
  double base_mm = kSheetBorder_mm + kTitleBlock_mm - 3 - kTitle_mm;
  std::vector<DrawnText> texts = {{title, {kLeft_mm, base_mm}, kTitle_mm, 0, Align::kLeft}};
  base_mm -= 1;
  const auto rows = static_cast<double>(notes.size());
  const double row_mm = std::min(kLine_mm, (base_mm - kLowest_mm) / rows);  // within the frame
  for (const std::string& note : notes) {
    base_mm -= row_mm;
    texts.push_back({note, {kLeft_mm, base_mm}, kNote_mm, 0, Align::kLeft});
  }
  return texts;
}

// The recording's name; "" where the map does not say it.
std::string GetProject(const MapResult& map) {
  std::filesystem::path path = std::filesystem::path(map.source.sequence).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  return (path.filename() == "mav0" ? path.parent_path() : path).filename().string();
}

// The day of the first image, UTC, where its stamps are since 1970 and not from a start of their
// own; "" else. The clock of the machine would give other bytes each day.
std::string FormatDate(const MapResult& map) {
  constexpr int64_t kYear2000_s = 946684800, kYear2100_s = 4102444800;
  if (map.trajectory.empty()) return "";
  const std::time_t stamp_s = map.trajectory.front().stamp_ns / 1000000000;
  if (stamp_s < kYear2000_s || stamp_s > kYear2100_s) return "";
  return fmt::format("{:%Y-%m-%d}", fmt::gmtime(stamp_s));
}

// Where the origin is, in what fits beside the legend.
std::string DescribePlace(const std::optional<Georeference>& place) {
  if (!place || IsShiftedOnly(place)) return GeoreferenceNote(place);
  const Eigen::Vector3d& p = place->origin_m;
  return fmt::format("Origin {:.2f}, {:.2f}, {:.2f} m, {}", p.x(), p.y(), p.z(),
                     place->crs.empty() ? "its grid" : place->crs);
}

// Degrees clockwise from up, and by what; of a map that is only shifted what up is.
std::pair<std::optional<double>, std::string> FindNorth(const MapResult& map,
                                                        const PlanOptions& options) {
  if (options.north_deg) return {options.north_deg, "as given"};
  if (IsShiftedOnly(map.source.georeference)) return {std::nullopt, "y of the given poses"};
  const auto north_rad = FindNorth_rad(map.source);
  if (!north_rad) return {};
  const std::string& crs = map.source.georeference->crs;
  return {std::remainder(-*north_rad * kDegreesPerRadian, 360),
          crs.empty() ? "that of the grid of control points" : "true north, by " + crs};
}

// One below the other, where plans have their arrow.
Drawing PlaceNote(const std::vector<std::string>& lines) {
  constexpr double kFirst_mm = 9;
  Drawing note;
  double base_mm = kFirst_mm;
  for (const std::string& line : lines) {
    note.texts.push_back({line, {0, base_mm}, kNote_mm, 0, Align::kLeft});
    base_mm -= kLine_mm;
  }
  return note;
}

struct SheetWords {
  std::string title;   // "Storey 0"
  std::string kind;    // "Floor plan"
  std::string number;  // of the sheet, after that of the drawing: "S0"
  // Where a section is; without, the arrow to the north is drawn.
  std::vector<std::string> place = {};
};

// What is written and drawn around the plans and sections of a map.
class TitleBlock {
 public:
  TitleBlock(const MapResult& map, const PlanOptions& options)
      : project_(options.project.empty() ? GetProject(map) : options.project),
        date_(options.date.empty() ? FormatDate(map) : options.date),
        number_(options.number.empty() ? map.id.substr(0, 8) : options.number),
        map_id_(map.id),
        place_(DescribePlace(map.source.georeference)),
        is_complete_(map.complete),
        in_mm_(options.millimetres) {
    std::tie(north_deg_, north_by_) = FindNorth(map, options);
  }

  const std::string& project() const { return project_; }  // "" where it is not known

  // Frames, texts, legend, scale bar and arrow: everything but the plan itself, in millimetres.
  Drawing Draw(const SheetFormat& format, const SheetWords& words, const Drawing& legend) const {
    constexpr double kLegendLeft_mm = 90, kBarFromRight_mm = 72, kLow_mm = 4, kArrow_mm = 13;
    const Vector2d low = Vector2d::Constant(kSheetBorder_mm);
    const Vector2d high = format.size_mm - low;
    const double right_mm = high.x() - kBarFromRight_mm;
    Drawing drawing;
    drawing.paths = {Frame(low, high), Frame(low, {high.x(), low.y() + kTitleBlock_mm})};
    drawing.texts = TitleTexts(words.title, Notes(format, words));
    drawing.Add(Placed(legend, 1, low + Vector2d(kLegendLeft_mm, kLow_mm)));
    drawing.Add(Placed(ScaleBar(format.scale), 1, {right_mm, low.y() + kLow_mm}));
    const Drawing orientation =
        words.place.empty() ? NorthArrow(north_deg_, north_by_) : PlaceNote(words.place);
    drawing.Add(Placed(orientation, 1, {right_mm, low.y() + kArrow_mm}));
    return drawing;
  }

 private:
  std::vector<std::string> Notes(const SheetFormat& format, const SheetWords& words) const {
    std::vector<std::string> notes = {
        fmt::format("{}, {}", project_.empty() ? "Project not named" : project_,
                    date_.empty() ? "date not known" : date_),
        fmt::format("{} 1:{} on {}, drawing {}{}", words.kind, format.scale, format.name,
                    number_.empty() ? "" : number_ + "-", words.number),
        in_mm_ ? "Millimetres, clear between measured faces"
               : "Metres, clear between measured faces",
        "~, about: a border was not seen, a thickness assumed"};
    if (!place_.empty()) notes.push_back(place_);
    const std::string partial = is_complete_ ? "" : "Partial: not all was mapped. ";
    if (!is_complete_ || !map_id_.empty())
      notes.push_back(fmt::format("{}Map {}", partial, map_id_));
    return notes;
  }

  std::string project_, date_, number_, map_id_, place_;
  bool is_complete_, in_mm_;
  std::optional<double> north_deg_;
  std::string north_by_;
};

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
