#include "apps/compare/comparison.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace slcmap::inline evaluation {

const std::vector<FigureInfo>& AllFigures() {
  const auto& [trajectory, straightness, lines, cost] = kFigureGroups;
  static const std::vector<FigureInfo> figures = {
      {"ape_online_m", "APE online", "m", trajectory, 4,
       "RMSE of the positions as they were known at once, after turning and moving the path onto "
       "the truth by translation and yaw (posyaw)",
       true, true},
      {"ape_final_m", "APE final", "m", trajectory, 4,
       "RMSE of the final positions after alignment by translation and yaw (posyaw)", true, true},
      {"ape_se3_final_m", "APE final, SE(3)", "m", trajectory, 4,
       "the same after alignment by translation and full rotation (SE(3))", true, true, false},
      {"rotation_final_deg", "rotation", "deg", trajectory, 3,
       "RMSE of the final orientations after the alignment by posyaw", true, true},
      {"rpe_1m_percent", "RPE 1 m", "%", trajectory, 3,
       "RMSE of the motion over 1 m of the path, in percent of it", true, true, false},
      {"rpe_5m_percent", "RPE 5 m", "%", trajectory, 3,
       "RMSE of the motion over 5 m of the path, in percent of it", true, true},
      {"rpe_10m_percent", "RPE 10 m", "%", trajectory, 3,
       "RMSE of the motion over 10 m of the path, in percent of it", true, true, false},
      {"loop_percent", "loop", "%", trajectory, 3,
       "error of the motion from the first pose to the last, in percent of the path, where the "
       "truth ends at its start",
       true, true},
      {"coverage_percent", "coverage", "%", trajectory, 1,
       "share of all images, the first ones too, that have a pose", false, true},
      {"edge_thickness_mm", "edges, thickness", "mm", straightness, 2,
       "RMS distance of single stereo observations of an edge from the one line through them"},
      {"edge_thickness_beyond_mm", "edges, beyond true poses", "mm", straightness, 2,
       "what of that is left without what the same observations have with true poses, by squares",
       true, true},
      {"edge_apart_under_1s_mm", "edges, apart in 1 s", "mm", straightness, 2,
       "distance between observations of one edge that are less than 1 s apart", true, false,
       false},
      {"edge_apart_over_30s_mm", "edges, apart after 30 s", "mm", straightness, 2,
       "distance between observations of one edge that are more than 30 s apart"},
      {"dispersion_deg", "directions", "deg", straightness, 3,
       "RMS angle of the lines to the three axes fitted to them"},
      {"orthogonality_deg", "off 90 deg", "deg", straightness, 3,
       "how far axes that are fitted alone are from a right angle"},
      {"mpv_mm2", "MPV of free points", "mm2", straightness, 1,
       "mean plane variance of stereo points that no plane was fitted to", true, false, false},
      {"mme_nats", "MME of free points", "nats", straightness, 3,
       "mean map entropy of the same points: less is crisper"},
      {"mom_mm2", "MOM of free points", "mm2", straightness, 1,
       "mean plane variance over mutually orthogonal planes of the same points", true, false,
       false},
      {"line_precision_5cm_percent", "lines within 5 cm", "%", lines, 1,
       "share of the mapped length with a true edge within 5 cm and 10 degrees", false, true},
      {"line_recall_5cm_percent", "edges found within 5 cm", "%", lines, 1,
       "share of the length of seen edges with a line that near", false, true},
      {"line_redundancy", "redundancy of lines", "", lines, 2,
       "mapped length over that of the edges found: 1 is ideal", true, true, false},
      {"cpu_ms_a_pair", "CPU a pair", "ms", cost, 1,
       "processor time of the odometry for a pair of images, of all threads"},
      {"wall_s_a_second", "time a second", "s", cost, 3,
       "time that passed for a second of the recording: 1 is real time", true, false, false},
      {"peak_memory_mib", "memory", "MiB", cost, 0, "most memory that the odometry had at once"}};
  return figures;
}

const FigureInfo& FindFigure(const std::string& key) {
  const auto found = std::find_if(AllFigures().begin(), AllFigures().end(),
                                  [&](const FigureInfo& info) { return info.key == key; });
  if (found == AllFigures().end()) throw std::out_of_range("no figure " + key);
  return *found;
}

namespace {

bool IsBetter(const Ranked& a, const Ranked& b, bool less_is_better) {
  return less_is_better ? IsBelow(a.spread, b.spread) : IsBelow(b.spread, a.spread);
}

std::string Listed(const std::vector<std::string>& names) {
  std::string text;
  for (size_t i = 0; i < names.size(); ++i) {
    text += i == 0 ? "" : i + 1 == names.size() ? " and " : ", ";
    text += names[i];
  }
  return text;
}

}  // namespace

Spread ComputeSpread(const std::vector<double>& values) {
  Spread spread;
  spread.count = static_cast<int>(values.size());
  if (values.empty()) return spread;
  for (const double value : values) spread.mean += value / spread.count;
  if (values.size() < 2) return spread;
  double squares = 0;
  for (const double value : values) squares += (value - spread.mean) * (value - spread.mean);
  spread.deviation = std::sqrt(squares / (spread.count - 1));
  return spread;
}

std::string SpreadText(const Spread& spread, int digits) {
  if (spread.count == 0) return "-";
  if (spread.count == 1) return fmt::format("{:.{}f}", spread.mean, digits);
  return fmt::format("{:.{}f} +- {:.{}f}", spread.mean, digits, spread.deviation, digits);
}

bool IsBelow(const Spread& a, const Spread& b) {
  if (a.count < 2 || b.count < 2) return false;
  const double error =
      std::sqrt(a.deviation * a.deviation / a.count + b.deviation * b.deviation / b.count);
  return b.mean - a.mean > 2 * error && b.mean > a.mean;
}

std::optional<size_t> FindBestMethod(const std::vector<Ranked>& methods, bool less_is_better) {
  if (methods.size() < 2) return std::nullopt;
  for (size_t i = 0; i < methods.size(); ++i) {
    bool best = true;
    for (size_t j = 0; j < methods.size(); ++j) {
      best = best && (i == j || IsBetter(methods[i], methods[j], less_is_better));
    }
    if (best) return i;
  }
  return std::nullopt;
}

std::string OrderInWords(const std::vector<Ranked>& methods, bool less_is_better) {
  const auto is_single = [](const Ranked& m) { return m.spread.count < 2; };
  if (methods.size() < 2) return "nothing to compare with";
  if (std::count_if(methods.begin(), methods.end(), is_single) + 1 >=
      static_cast<std::ptrdiff_t>(methods.size())) {
    return "single runs: nothing says how far they scatter, so no order";
  }
  std::vector<Ranked> sorted = methods;
  std::stable_sort(sorted.begin(), sorted.end(), [&](const Ranked& a, const Ranked& b) {
    return less_is_better ? a.spread.mean < b.spread.mean : b.spread.mean < a.spread.mean;
  });
  std::vector<std::string> parts;
  for (const Ranked& better : sorted) {
    std::vector<std::string> worse;
    for (const Ranked& other : sorted) {
      if (IsBetter(better, other, less_is_better)) worse.push_back(other.name);
    }
    if (!worse.empty()) parts.push_back(better.name + " before " + Listed(worse));
  }
  return parts.empty() ? "the spread bears no order" : fmt::format("{}", fmt::join(parts, "; "));
}

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
std::string GroupTable(const SequenceResult& sequence, const char* group) {
  constexpr size_t kWidth = 110;
  std::vector<std::string> names = {""};
  for (const MethodResult& method : sequence.methods) names.push_back(method.name);
  std::string text;
  Columns columns = {names};
  size_t width = 0;
  for (const FigureInfo& figure : SelectFigures(sequence, group)) {
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
  return std::string("\n") + group + "\n" + text + Rows(columns);
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

std::vector<FigureInfo> SelectFigures(const SequenceResult& sequence, const char* group) {
  std::vector<FigureInfo> figures;
  for (const FigureInfo& figure : AllFigures()) {
    if (figure.group != group || !figure.in_table) continue;
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
    for (const char* group : kFigureGroups) text += GroupTable(sequence, group);
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
