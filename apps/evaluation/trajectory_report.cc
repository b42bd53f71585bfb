#include "apps/evaluation/trajectory_report.h"

#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>

#include "apps/evaluation/no_figure.h"

namespace slcmap {
namespace {

using Json = nlohmann::ordered_json;

std::string AbsoluteRow(const AbsoluteError& error) {
  const ErrorStatistics& p = error.position_m;
  std::string row = fmt::format("{:<8}{:>9.4f}{:>9.4f}{:>9.4f}{:>9.4f}{:>9}{:>9.3f}",
                                AlignmentName(error.kind), p.rmse, p.mean, p.median, p.max,
                                FigureText(error.rmse_percent, 3), error.rotation_deg.rmse);
  if (error.kind == AlignmentKind::kSimilarity) {
    row += fmt::format("   scale {:.4f}; for methods without scale only", error.alignment.scale);
  }
  return row + "\n";
}

std::string RelativeRow(const RelativeError& error) {
  if (error.pieces == 0) return fmt::format("{:<8g}  (the path is shorter)\n", error.length_m);
  return fmt::format("{:<8g}{:>9.3f}{:>9.3f}{:>9.3f}{:>9.4f}{:>9}\n", error.length_m,
                     error.translation_rmse_percent, error.translation_median_percent,
                     error.rotation_rmse_deg, error.rotation_rmse_deg_m, error.pieces);
}

std::string CoverageRows(const EvaluationInputs& inputs, const TrajectoryMetrics& metrics) {
  const Coverage& coverage = metrics.coverage;
  std::string text =
      fmt::format("coverage  {:.2f} % of the stamps of {}, {:.2f} % after initialisation{}\n",
                  100 * coverage.overall, inputs.stamps.empty() ? "the truth" : inputs.stamps,
                  100 * coverage.after_initialisation,
                  coverage.flagged ? "  << FLAGGED: too low to compare the errors" : "");
  return text + fmt::format("poses     {} ({} with a truth), in {} piece{}\n",
                            metrics.estimated_poses, metrics.poses.size(), metrics.pieces,
                            metrics.pieces == 1 ? "" : "s");
}

Json StatisticsJson(const ErrorStatistics& statistics) {
  return {{"rmse", statistics.rmse},
          {"mean", statistics.mean},
          {"median", statistics.median},
          {"max", statistics.max}};
}

Json AbsoluteJson(const AbsoluteError& error) {
  const Eigen::Vector3d& t = error.alignment.T_truth_estimate.translation;
  const Eigen::Quaterniond& q = error.alignment.T_truth_estimate.rotation;
  return {{"position_m", StatisticsJson(error.position_m)},
          {"rotation_deg", StatisticsJson(error.rotation_deg)},
          {"rmse_percent_of_path", error.rmse_percent},
          {"alignment",
           {{"scale", error.alignment.scale},
            {"translation_m", {t.x(), t.y(), t.z()}},
            {"rotation_qx_qy_qz_qw", {q.x(), q.y(), q.z(), q.w()}}}}};
}

Json RelativeJson(const RelativeError& error) {
  return {{"length_m", error.length_m},
          {"pieces", error.pieces},
          {"translation_rmse_percent", error.translation_rmse_percent},
          {"translation_median_percent", error.translation_median_percent},
          {"rotation_rmse_deg", error.rotation_rmse_deg},
          {"rotation_rmse_deg_per_m", error.rotation_rmse_deg_m}};
}

}  // namespace

std::string TrajectoryTable(const EvaluationInputs& inputs, const TrajectoryMetrics& metrics) {
  std::string text = fmt::format("truth     {}\nestimate  {}\n", inputs.truth, inputs.estimate);
  text += CoverageRows(inputs, metrics);
  text += fmt::format("path      {:.2f} m (truth), {:.2f} m (estimate)\n\n", metrics.truth_length_m,
                      metrics.estimate_length_m);
  text += "APE       RMSE m   mean m median m    max m   % path  rot deg\n";
  for (const AbsoluteError& error : metrics.absolute) text += AbsoluteRow(error);
  text += "\nRPE m     RMSE % median %  rot deg    deg/m   pieces\n";
  for (const RelativeError& error : metrics.relative) text += RelativeRow(error);
  text += fmt::format("\nheading   {:.3f} deg off at the end, against that at the start\n",
                      metrics.heading_error_deg);
  if (metrics.loop) {
    text += fmt::format("loop      {:.3f} m from start to end, {:.3f} % of the path\n",
                        metrics.loop->distance_m, metrics.loop->percent);
  }
  if (!inputs.finding.empty()) text += fmt::format("\nfinding   {}\n", inputs.finding);
  return text;
}

Json TrajectoryJson(const EvaluationInputs& inputs, const TrajectoryMetrics& metrics) {
  Json json = {{"truth", inputs.truth},
               {"estimate", inputs.estimate},
               {"coverage",
                {{"stamps", inputs.stamps.empty() ? inputs.truth : inputs.stamps},
                 {"overall", metrics.coverage.overall},
                 {"after_initialisation", metrics.coverage.after_initialisation},
                 {"flagged", metrics.coverage.flagged}}},
               {"poses", metrics.estimated_poses},
               {"associated_poses", metrics.poses.size()},
               {"pieces", metrics.pieces},
               {"truth_length_m", metrics.truth_length_m},
               {"estimate_length_m", metrics.estimate_length_m}};
  for (const AbsoluteError& error : metrics.absolute) {
    json["ape"][AlignmentName(error.kind)] = AbsoluteJson(error);
  }
  json["rpe"] = Json::array();
  for (const RelativeError& error : metrics.relative) json["rpe"].push_back(RelativeJson(error));
  json["heading_error_at_end_deg"] = metrics.heading_error_deg;
  if (!inputs.finding.empty()) json["finding"] = inputs.finding;
  json["loop"] = nullptr;
  if (metrics.loop) {
    json["loop"] = {{"distance_m", metrics.loop->distance_m},
                    {"percent_of_path", metrics.loop->percent}};
  }
  return json;
}

}  // namespace slcmap
