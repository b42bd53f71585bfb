#include "export/plan/title_block.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <ctime>
#include <filesystem>

#include "export/plan/legend.h"
#include "export/world_offset.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;

constexpr double kTitle_mm = 4, kNote_mm = 2;

DrawnPath Frame(const Vector2d& low, const Vector2d& high) {
  return {Pen::kFrame, {low, {high.x(), low.y()}, high, {low.x(), high.y()}, low}};
}

// Title and notes, from the top of the title block down.
std::vector<DrawnText> TitleTexts(const std::string& title, const std::vector<std::string>& notes) {
  constexpr double kLeft_mm = kSheetBorder_mm + 4, kLine_mm = 4, kLowest_mm = kSheetBorder_mm + 2;
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

// One below the other, where plans have their arrow.
Drawing PlaceNote(const std::vector<std::string>& lines) {
  constexpr double kFirst_mm = 9, kLine_mm = 4;
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
    : project_(options.project.empty() ? ProjectOf(map) : options.project),
      date_(options.date.empty() ? DateOf(map) : options.date),
      number_(options.number.empty() ? map.id.substr(0, 8) : options.number),
      map_id_(map.id),
      offset_(WorldOffsetNote(map.source.world_offset_m)),
      is_complete_(map.complete),
      is_far_(IsFar(map.source)),
      in_mm_(options.millimetres),
      north_deg_(options.north_deg) {}

std::vector<std::string> TitleBlock::Notes(const SheetFormat& format,
                                           const SheetWords& words) const {
  std::vector<std::string> notes = {
      fmt::format("{}, {}", project_.empty() ? "Project not named" : project_,
                  date_.empty() ? "date not known" : date_),
      fmt::format("{} 1:{} on {}, drawing {}{}", words.kind, format.scale, format.name,
                  number_.empty() ? "" : number_ + "-", words.number),
      in_mm_ ? "Millimetres, clear between measured faces" : "Metres, clear between measured faces",
      "~, about: a border was not seen, a thickness assumed"};
  if (!offset_.empty()) notes.push_back(offset_);
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
      words.place.empty() ? NorthArrow(north_deg_, is_far_) : PlaceNote(words.place);
  drawing.Add(Placed(orientation, 1, {right_mm, low.y() + kArrow_mm}));
  return drawing;
}

}  // namespace slcmap
