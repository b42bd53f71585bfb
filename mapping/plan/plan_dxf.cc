#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "data/core/error.h"
#include "data/io/csv.h"
#include "data/io/file.h"
#include "mapping/plan/plan_files.h"

namespace slcmap::inline mapping {
namespace {

// A group code and its value.
struct DxfGroup {
  int code = 0;
  std::string_view value;
};

std::string_view Trimmed(std::string_view text) {
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.front()))) {
    text.remove_prefix(1);
  }
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) {
    text.remove_suffix(1);
  }
  return text;
}

std::vector<DxfGroup> SplitGroups(const std::string& path, const std::string& text) {
  std::vector<DxfGroup> groups;
  std::string_view code;
  bool has_code = false;
  for (std::size_t from = 0, row = 1; from < text.size(); ++row) {
    const std::size_t end = std::min(text.find('\n', from), text.size());
    const std::string_view line = Trimmed(std::string_view(text).substr(from, end - from));
    from = end + 1;
    if (has_code) {
      groups.push_back({static_cast<int>(*ParseNumber(code)), line});
    } else if (code = line; !ParseNumber(code)) {
      throw DataError(
          fmt::format("{}: row {}: found '{}', expected a group code of a DXF text file", path, row,
                      line.substr(0, 40)));
    }
    has_code = !has_code;
  }
  return groups;
}

std::string UpperCase(std::string_view text) {
  std::string upper(text);
  for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return upper;
}

// What one drawing unit is, by $INSUNITS.
std::optional<double> UnitFor(int insunits) {
  static const std::map<int, double> units = {{1, 0.0254}, {2, 0.3048}, {4, 1e-3},
                                              {5, 1e-2},   {6, 1},      {14, 0.1}};
  const auto unit = units.find(insunits);
  return unit == units.end() ? std::nullopt : std::optional(unit->second);
}

// Lines by the storey that a layer's name begins with.
class DxfLines {
 public:
  DxfLines(const std::string& path, const std::vector<DxfGroup>& groups) : path_(path) {
    std::string_view section, variable;
    for (std::size_t i = 0; i < groups.size(); ++i) {
      const DxfGroup& group = groups[i];
      if (group.code == 2 && i > 0 && groups[i - 1].value == "SECTION") section = group.value;
      if (section == "HEADER" && group.code == 9) variable = group.value;
      if (section == "HEADER" && group.code == 70 && variable == "$INSUNITS") {
        unit_m_ = UnitFor(static_cast<int>(Number(group)));
      }
      if (section == "ENTITIES") Add(group);
    }
    Finish();
  }

  const std::map<std::string, std::vector<PlanPoints>>& lines() const { return lines_; }
  const std::set<std::string>& other_layers() const { return other_layers_; }
  std::optional<double> unit_m() const { return unit_m_; }

 private:
  double Number(const DxfGroup& group) const {
    const std::optional<double> number = ParseNumber(group.value);
    if (number && std::abs(*number) < 1e9) return *number;
    throw DataError(fmt::format("{}: group {}: found '{}', expected a number within 1e9", path_,
                                group.code, group.value.substr(0, 40)));
  }

  void Add(const DxfGroup& group) {
    if (group.code == 0) {
      // Vertices belong to the polyline before them.
      if (group.value == "VERTEX" && entity_ == "POLYLINE") {
        in_vertex_ = true;
        return;
      }
      Finish();
      entity_ = group.value;
    } else if (group.code == 8 && !in_vertex_) {
      layer_ = UpperCase(group.value);
    } else if (group.code == 70 && !in_vertex_) {
      closed_ = (static_cast<int>(Number(group)) & 1) != 0;
    } else if (group.code == 10 || group.code == 11) {
      if (entity_ == "POLYLINE" && !in_vertex_) return;  // of no meaning
      points_.emplace_back(Number(group), 0);
    } else if ((group.code == 20 || group.code == 21) && !points_.empty()) {
      points_.back().y() = Number(group);
    }
  }

  void Finish() {
    const bool is_line = entity_ == "LINE" || entity_ == "LWPOLYLINE" || entity_ == "POLYLINE";
    if (is_line && points_.size() >= 2) {
      if (closed_ && entity_ != "LINE") points_.push_back(points_.front());
      const std::size_t at = std::min(layer_.find("WALL"), layer_.find("WAND"));
      if (at == std::string::npos)
        other_layers_.insert(layer_);
      else
        lines_[layer_.substr(0, at)].push_back(points_);
    }
    entity_ = "", layer_ = "", points_.clear();
    in_vertex_ = closed_ = false;
  }

  const std::string path_;
  std::map<std::string, std::vector<PlanPoints>> lines_;
  std::set<std::string> other_layers_;
  std::optional<double> unit_m_;
  std::string entity_, layer_;
  PlanPoints points_;
  bool in_vertex_ = false, closed_ = false;
};

}  // namespace

std::vector<BuildingPlan> ReadDxfPlans(const std::string& path) {
  const std::string text = ReadFile(path);
  if (text.starts_with("AutoCAD Binary DXF")) {
    throw DataError(path + ": found a binary DXF file, expected a text one: save it as ASCII DXF");
  }
  const DxfLines drawing(path, SplitGroups(path, text));
  if (drawing.lines().empty()) {
    throw DataError(fmt::format(
        "{}: found lines on the layers '{}', expected some on layers named WALL: rename those of "
        "walls",
        path, fmt::join(drawing.other_layers(), "', '")));
  }
  std::vector<BuildingPlan> plans;
  for (auto [name, lines] : drawing.lines()) {
    for (PlanPoints& line : lines) {
      for (Eigen::Vector2d& point : line) point *= drawing.unit_m().value_or(1);
    }
    plans.emplace_back();
    plans.back().name = name;
    AddLines(lines, &plans.back());
  }
  return plans;
}

}  // namespace slcmap::mapping
