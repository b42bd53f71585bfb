#include "apps/compare/comparison.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace slcmap::inline evaluation {
namespace {

using Json = nlohmann::ordered_json;

std::string Head(const FigureInfo& figure) {
  return *figure.unit ? fmt::format("{} [{}]", figure.label, figure.unit) : figure.label;
}

Json FigureJson(const MethodResult& method, const FigureInfo& figure) {
  const std::vector<double> values = method.Values(figure.key);
  const Spread spread = ComputeSpread(values);
  return {{"mean", spread.mean},
          {"deviation", spread.count > 1 ? Json(spread.deviation) : Json()},
          {"runs", values}};
}

Json MethodJson(const MethodResult& method) {
  Json json = {{"name", method.name}, {"runs", method.repeats.size()}, {"remarks", method.remarks}};
  json["figures"] = Json::object();
  for (const FigureInfo& figure : AllFigures()) {
    if (!method.Values(figure.key).empty())
      json["figures"][figure.key] = FigureJson(method, figure);
  }
  json["stages_ms_a_pair"] = Json::object();
  for (const StageCost& stage : method.stages)
    json["stages_ms_a_pair"][stage.name] = stage.ms_a_pair;
  return json;
}

Json SequenceJson(const SequenceResult& sequence, int repeats) {
  Json json = {{"name", sequence.name},
               {"path", sequence.path},
               {"length_m", sequence.length_m},
               {"duration_s", sequence.duration_s},
               {"true_poses", sequence.true_poses},
               {"true_edges", sequence.true_edges},
               {"observations", sequence.reference},
               {"notes", NotesOn(sequence, repeats)},
               {"with_true_poses", sequence.with_true_poses}};
  json["methods"] = Json::array();
  for (const MethodResult& method : sequence.methods) json["methods"].push_back(MethodJson(method));
  json["order"] = Json::object();
  for (const FigureInfo& figure : AllFigures()) {
    const std::vector<Ranked> methods = sequence.Of(figure);
    if (methods.size() < 2) continue;
    json["order"][figure.key] = OrderInWords(methods, figure.less_is_better);
  }
  return json;
}

std::string CsvField(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

using Columns = std::vector<std::vector<std::string>>;  // each from its head down

std::vector<std::string> FigureColumn(const SequenceResult& sequence, const FigureInfo& figure) {
  const std::vector<Ranked> all = sequence.Of(figure);
  const auto best = FindBestMethod(all, figure.less_is_better);
  std::vector<std::string> column = {Head(figure)};
  for (const MethodResult& method : sequence.methods) {
    const bool is_best = best && all[*best].name == method.name;
    column.push_back(SpreadText(ComputeSpread(method.Values(figure.key)), figure.digits) +
                     (is_best ? " *" : "  "));
  }
  return column;
}

std::string Rows(const Columns& columns) {
  std::string text;
  for (size_t row = 0; row < columns.front().size(); ++row) {
    for (size_t i = 0; i < columns.size(); ++i) {
      size_t width = 0;
      for (const std::string& cell : columns[i]) width = std::max(width, cell.size());
      text += i == 0 ? fmt::format("  {:<{}}", columns[i][row], width)
                     : fmt::format("  {:>{}}", columns[i][row], width);
    }
    while (text.back() == ' ') text.pop_back();
    text += "\n";
  }
  return text;
}

// A table of one group: a row a method, a column a figure; the best is marked where there is one.
// What is too wide for a terminal goes on below.
std::string GroupTable(const SequenceResult& sequence, FigureGroup group) {
  constexpr size_t kWidth = 110;
  std::vector<std::string> names = {""};
  for (const MethodResult& method : sequence.methods) names.push_back(method.name);
  std::string text;
  Columns columns = {names};
  size_t width = 0;
  for (const FigureInfo& figure : SelectFigures(sequence, group, true)) {
    std::vector<std::string> column = FigureColumn(sequence, figure);
    const size_t more = std::max_element(column.begin(), column.end(),
                                         [](auto& a, auto& b) { return a.size() < b.size(); })
                            ->size() +
                        2;
    if (columns.size() > 1 && width + more > kWidth) {
      text += Rows(columns);
      columns = {names};
      width = 0;
    }
    width += more;
    columns.push_back(std::move(column));
  }
  if (columns.size() == 1) return "";
  return "\n" + GroupTitle(group) + "\n" + text + Rows(columns);
}

}  // namespace

std::vector<double> MethodResult::Values(const std::string& key) const {
  std::vector<double> values;
  for (const Figures& figures : repeats) {
    const auto value = figures.find(key);
    if (value != figures.end()) values.push_back(value->second);
  }
  return values;
}

std::vector<Ranked> SequenceResult::Of(const FigureInfo& figure) const {
  std::vector<Ranked> ranked;
  for (const MethodResult& method : methods) {
    const Spread spread = ComputeSpread(method.Values(figure.key));
    if (spread.count > 0) ranked.push_back({method.name, spread});
  }
  return ranked;
}

std::vector<FigureInfo> SelectFigures(const SequenceResult& sequence, FigureGroup group,
                                      bool in_table_only) {
  std::vector<FigureInfo> figures;
  for (const FigureInfo& figure : AllFigures()) {
    if (figure.group != group || (in_table_only && !figure.in_table)) continue;
    if (!sequence.Of(figure).empty()) figures.push_back(figure);
  }
  return figures;
}

Json ComparisonJson(const Comparison& comparison) {
  Json json = {{"format", "slcmap comparison"}, {"version", 1},
               {"slcmap", comparison.version},  {"date", comparison.date},
               {"machine", comparison.machine}, {"command", comparison.command},
               {"repeats", comparison.repeats}, {"figures", Json::object()}};
  for (const FigureInfo& figure : AllFigures()) {
    json["figures"][figure.key] = {{"label", figure.label},
                                   {"unit", figure.unit},
                                   {"less_is_better", figure.less_is_better},
                                   {"needs_truth", figure.needs_truth}};
  }
  json["sequences"] = Json::array();
  for (const SequenceResult& sequence : comparison.sequences) {
    json["sequences"].push_back(SequenceJson(sequence, comparison.repeats));
  }
  return json;
}

std::string ComparisonCsv(const Comparison& comparison) {
  std::string text = "sequence,method,figure,unit,mean,deviation,runs\n";
  for (const SequenceResult& sequence : comparison.sequences) {
    for (const MethodResult& method : sequence.methods) {
      for (const FigureInfo& figure : AllFigures()) {
        const Spread spread = ComputeSpread(method.Values(figure.key));
        if (spread.count == 0) continue;
        text += fmt::format("{},{},{},{},{:.9g},{},{}\n", CsvField(sequence.name),
                            CsvField(method.name), figure.key, figure.unit, spread.mean,
                            spread.count > 1 ? fmt::format("{:.9g}", spread.deviation) : "",
                            spread.count);
      }
    }
  }
  return text;
}

std::string ComparisonTable(const Comparison& comparison) {
  std::string text;
  for (const SequenceResult& sequence : comparison.sequences) {
    text += fmt::format("\n=== {} ({:.1f} m, {:.0f} s)\n", sequence.name, sequence.length_m,
                        sequence.duration_s);
    for (const FigureGroup group : kFigureGroups) text += GroupTable(sequence, group);
    text += "\n";
    for (const MethodResult& method : sequence.methods) {
      for (const std::string& remark : method.remarks) text += method.name + ": " + remark + "\n";
    }
    for (const std::string& note : NotesOn(sequence, comparison.repeats)) text += note + "\n";
  }
  return text;
}

std::vector<std::string> NotesOn(const SequenceResult& sequence, int repeats) {
  std::vector<std::string> notes;
  if (!sequence.reference.empty()) notes.push_back("Straightness: " + sequence.reference);
  if (sequence.true_poses) {
    notes.push_back(
        "Trajectory errors are RMSE (root mean square) after alignment by translation and yaw "
        "(posyaw), which is what such an estimator cannot observe; the scale is not aligned.");
  }
  if (!sequence.true_poses) {
    notes.push_back(
        "No truth: made without it are straightness, flatness and cost; trajectory "
        "errors and coverage are left out.");
  }
  const auto floor = sequence.with_true_poses.find("edge_thickness_mm");
  if (floor != sequence.with_true_poses.end()) {
    notes.push_back(fmt::format(
        "With the true poses the same observations make edges {:.2f} mm thick: {}", floor->second,
        sequence.truth_is_floor
            ? "what stereo and the building have of their own, below which no method can be."
            : "more than with some method's, so these poses are no floor, and what is beyond them "
              "is not told."));
  }
  notes.push_back(repeats < 2
                      ? "One run each: nothing says how far they scatter, so nothing is ranked."
                      : fmt::format("Mean and standard deviation of {} runs with other numbers of "
                                    "points; * marks the best where the means are further apart "
                                    "than twice their standard error.",
                                    repeats));
  return notes;
}

}  // namespace slcmap::evaluation
