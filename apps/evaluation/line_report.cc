#include "apps/evaluation/line_report.h"

#include <spdlog/fmt/fmt.h>

#include <array>
#include <nlohmann/json.hpp>
#include <utility>

#include "apps/evaluation/no_figure.h"
#include "apps/evaluation/svg_plot.h"
#include "data/file.h"

namespace slcmap {
namespace {

using Json = nlohmann::ordered_json;

constexpr char kTruthColour[] = "#bbbbbb";
constexpr std::array<std::pair<LineAxis, const char*>, 5> kAxisNames = {
    {{LineAxis::kX, "X"},
     {LineAxis::kY, "Y"},
     {LineAxis::kVertical, "vertical"},
     {LineAxis::kSloped, "sloped"},
     {LineAxis::kNone, "no axis"}}};

std::string ScoreRow(const LineScore& score) {
  const std::string clear =
      score.clear_recall ? fmt::format("{:>16}", FigureText(100 * *score.clear_recall, 1)) : "";
  return fmt::format("{:<9.2f}{:>10.2f}{:>10}{:>12}{:>12}{}\n", score.tolerance_m, score.recall_m,
                     FigureText(100 * score.recall, 1), FigureText(100 * score.precision, 1),
                     FigureText(score.redundancy, 2), clear);
}

std::string KindTable(const LineMetrics& metrics) {
  std::string text =
      fmt::format("\nmarks     {:.2f} m\n\nwithin m  marks called edges %  edges called marks %\n",
                  metrics.marks_length_m);
  for (const KindScore& score : metrics.kinds) {
    text += fmt::format("{:<9.2f}{:>21}{:>22}\n", score.tolerance_m,
                        FigureText(100 * score.marks_called_edges, 1),
                        FigureText(100 * score.edges_called_marks, 1));
  }
  return text;
}

Json ScoreJson(const LineScore& score) {
  Json json = {{"tolerance_m", score.tolerance_m},
               {"recall_m", score.recall_m},
               {"recall", score.recall},
               {"precision", score.precision},
               {"redundancy", score.redundancy}};
  if (score.clear_recall) json["clear_recall"] = *score.clear_recall;
  return json;
}

Json KindsJson(const LineMetrics& metrics) {
  Json json = {{"marks_length_m", metrics.marks_length_m}, {"scores", Json::array()}};
  for (const KindScore& score : metrics.kinds) {
    json["scores"].push_back({{"tolerance_m", score.tolerance_m},
                              {"marks_called_edges", score.marks_called_edges},
                              {"edges_called_marks", score.edges_called_marks}});
  }
  return json;
}

Json AccuracyJson(const LineAccuracy& accuracy) {
  return {{"length_m", accuracy.length_m},
          {"direction_mean_deg", accuracy.direction_mean_deg},
          {"direction_rms_deg", accuracy.direction_rms_deg},
          {"offset_rms_m", accuracy.offset_rms_m}};
}

void AddSegment(const Eigen::Vector3d& start, const Eigen::Vector3d& end, SvgSeries* series) {
  series->points.emplace_back(start.head<2>());
  series->points.emplace_back(end.head<2>());
}

// Dark on a white page: the colours of the old lines.
std::string PageColour(LineAxis axis) {
  const auto [red, green, blue] = LineColour(axis, false);
  return fmt::format("#{:02x}{:02x}{:02x}", red, green, blue);
}

}  // namespace

std::string LineTable(const LineInputs& inputs, const LineMetrics& metrics) {
  std::string text = fmt::format(
      "edges     {}, {:.2f} m seen\nlines     {}, {} lines of {:.2f} m\n", inputs.true_edges,
      metrics.seen_length_m, inputs.lines, metrics.lines, metrics.mapped_length_m);
  if (metrics.without_extent > 0) {
    text +=
        fmt::format("          {} of them without extent, not counted\n", metrics.without_extent);
  }
  if (metrics.clear_length_m) {
    text += fmt::format("          {:.2f} m of the edges seen clearly\n", *metrics.clear_length_m);
  }
  text += "\nwithin m  recall m  recall %  precision %  redundancy";
  text += metrics.clear_length_m ? "  clear recall %\n" : "\n";
  for (const LineScore& score : metrics.scores) text += ScoreRow(score);
  if (metrics.accuracy) {
    const LineAccuracy& accuracy = *metrics.accuracy;
    text += fmt::format(
        "\nlines     direction {:.3f} deg mean, {:.3f} deg RMS, offset {:.4f} m RMS, over the "
        "{:.2f} m within {} m\n",
        accuracy.direction_mean_deg, accuracy.direction_rms_deg, accuracy.offset_rms_m,
        accuracy.length_m, metrics.scores.back().tolerance_m);
  }
  if (metrics.gaps.gaps + metrics.gaps.pairs > 0) {
    text += fmt::format(
        "apart     {} of {} gaps in doorways, {} of {} pairs of edges 4 to 8 cm apart, {} of {} of "
        "these at jambs\n",
        metrics.gaps.gaps_kept, metrics.gaps.gaps, metrics.gaps.pairs_kept, metrics.gaps.pairs,
        metrics.gaps.jambs_kept, metrics.gaps.jambs);
  }
  if (!metrics.kinds.empty()) text += KindTable(metrics);
  return text;
}

Json LineJson(const LineInputs& inputs, const LineMetrics& metrics) {
  Json json = {{"true_edges", inputs.true_edges},
               {"file", inputs.lines},
               {"lines", metrics.lines},
               {"without_extent", metrics.without_extent},
               {"mapped_length_m", metrics.mapped_length_m},
               {"seen_length_m", metrics.seen_length_m}};
  if (metrics.clear_length_m) json["clear_length_m"] = *metrics.clear_length_m;
  json["scores"] = Json::array();
  for (const LineScore& score : metrics.scores) json["scores"].push_back(ScoreJson(score));
  json["accuracy"] = metrics.accuracy ? AccuracyJson(*metrics.accuracy) : Json();
  json["gaps"] = {{"found", metrics.gaps.gaps}, {"kept", metrics.gaps.gaps_kept}};
  json["pairs"] = {{"found", metrics.gaps.pairs}, {"kept", metrics.gaps.pairs_kept}};
  json["jambs"] = {{"found", metrics.gaps.jambs}, {"kept", metrics.gaps.jambs_kept}};
  if (!metrics.kinds.empty()) json["kinds"] = KindsJson(metrics);
  return json;
}

void WriteLinePlan(const std::string& path, const TrueEdges& truth,
                   const std::vector<MapLine>& lines) {
  SvgPlot plot{"Mapped lines over true edges, from above", "x [m]", "y [m]", true, {}};
  plot.series.push_back({"true edges", kTruthColour, {}, SvgStyle::kSegments});
  for (const PlySegment& edge : truth.seen) {
    AddSegment(edge.start_world, edge.end_world, &plot.series.back());
  }
  for (const auto& [axis, name] : kAxisNames) {
    SvgSeries series{name, PageColour(axis), {}, SvgStyle::kSegments};
    for (const MapLine& line : lines) {
      if (line.axis == axis) AddSegment(line.start_world, line.end_world, &series);
    }
    if (!series.points.empty()) plot.series.push_back(series);
  }
  WriteFile(path, DrawSvg(plot));
}

}  // namespace slcmap
