#include "export/plan/title_block.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <tuple>

#include "export/plan/symbols.h"
#include "export/scene/building_solids.h"
#include "export/scene/map_writer.h"

namespace slcmap::inline exporting {
namespace {

using Eigen::Vector2d;

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

}  // namespace

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

namespace {

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
  std::tm utc{};
  gmtime_r(&stamp_s, &utc);
  return fmt::format("{:04}-{:02}-{:02}", utc.tm_year + 1900, utc.tm_mon + 1, utc.tm_mday);
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

}  // namespace

TitleBlock::TitleBlock(const MapResult& map, const PlanOptions& options)
    : project_(options.project.empty() ? GetProject(map) : options.project),
      date_(options.date.empty() ? FormatDate(map) : options.date),
      number_(options.number.empty() ? map.id.substr(0, 8) : options.number),
      map_id_(map.id),
      place_(DescribePlace(map.source.georeference)),
      is_complete_(map.complete),
      in_mm_(options.millimetres) {
  std::tie(north_deg_, north_by_) = FindNorth(map, options);
}

std::vector<std::string> TitleBlock::Notes(const SheetFormat& format,
                                           const SheetWords& words) const {
  std::vector<std::string> notes = {
      fmt::format("{}, {}", project_.empty() ? "Project not named" : project_,
                  date_.empty() ? "date not known" : date_),
      fmt::format("{} 1:{} on {}, drawing {}{}", words.kind, format.scale, format.name,
                  number_.empty() ? "" : number_ + "-", words.number),
      in_mm_ ? "Millimetres, clear between measured faces" : "Metres, clear between measured faces",
      "~, about: a border was not seen, a thickness assumed"};
  if (!place_.empty()) notes.push_back(place_);
  const std::string partial = is_complete_ ? "" : "Partial: not all was mapped. ";
  if (!is_complete_ || !map_id_.empty()) notes.push_back(fmt::format("{}Map {}", partial, map_id_));
  return notes;
}

Drawing TitleBlock::Draw(const SheetFormat& format, const SheetWords& words,
                         const Drawing& legend) const {
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

}  // namespace slcmap::exporting
