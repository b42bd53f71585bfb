#include "apps/evaluation/surface_report.h"

#include <spdlog/fmt/fmt.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "apps/evaluation/no_figure.h"
#include "data/calibration.h"

namespace slcmap {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kCast = 0.4;  // share of the time, about, that casting rays takes

Rig TrueRig(const SurfaceInputs& inputs) {
  const std::string path =
      inputs.rig.empty()
          ? std::filesystem::path(inputs.true_surfaces).replace_filename("rig.yaml").string()
          : inputs.rig;
  Warnings warnings;
  return ReadCalibration(path, &warnings).rig;
}

std::string CloudTable(const SurfaceInputs& inputs, const CloudMetrics& metrics,
                       const CloudMetricOptions& options) {
  std::string text = fmt::format(
      "cloud     {}, {} points, {} of them filled, {} m RMS\n"
      "          filled where something was seen {} %\n",
      inputs.cloud, metrics.points, metrics.filled, FigureText(metrics.rms_m, 4),
      FigureText(100 * metrics.filled_seen, 1));
  text += "\nwithin m  accuracy %  filled %";
  for (const double range_m : options.ranges_m) {
    text += fmt::format("{:>16}{:>9}", fmt::format("seen <{} m %", range_m), "F %");
  }
  text += "\n";
  for (const CloudScore& score : metrics.scores) {
    text +=
        fmt::format("{:<9.2f}{:>11}{:>10}", score.tolerance_m, FigureText(100 * score.accuracy, 1),
                    FigureText(100 * score.filled_accuracy, 1));
    for (std::size_t i = 0; i < score.f.size(); ++i) {
      text += fmt::format("{:>16}{:>9}", FigureText(100 * score.completeness[i], 1),
                          FigureText(100 * score.f[i], 1));
    }
    text += "\n";
  }
  return text;
}

std::string OccupancyTable(const SurfaceInputs& inputs, const OccupancyMetrics& metrics) {
  return fmt::format(
      "\noccupancy {}, {} rays\n"
      "          end cells occupied {} %, they or those beside them {} %\n"
      "          passages known {} %, free of these {} %\n"
      "          called free of {} samples behind surfaces {} %\n",
      inputs.occupancy, metrics.rays, FigureText(100 * metrics.ends_occupied, 1),
      FigureText(100 * metrics.ends_occupied_nearby, 1),
      FigureText(100 * metrics.passages_known, 1), FigureText(100 * metrics.passages_free, 2),
      metrics.behind, FigureText(100 * metrics.behind_called_free, 2));
}

Json ScoreJson(const CloudScore& score, const CloudMetricOptions& options) {
  Json json = {{"tolerance_m", score.tolerance_m},
               {"accuracy", score.accuracy},
               {"filled_accuracy", score.filled_accuracy}};
  for (std::size_t i = 0; i < score.f.size(); ++i) {
    json["ranges"].push_back({{"seen_within_m", options.ranges_m[i]},
                              {"completeness", score.completeness[i]},
                              {"f", score.f[i]}});
  }
  return json;
}

Json OccupancyJson(const OccupancyMetrics& metrics) {
  return {{"rays", metrics.rays},
          {"ends_occupied", metrics.ends_occupied},
          {"ends_occupied_nearby", metrics.ends_occupied_nearby},
          {"passages_known", metrics.passages_known},
          {"passages_free", metrics.passages_free},
          {"behind_samples", metrics.behind},
          {"behind_called_free", metrics.behind_called_free}};
}

}  // namespace

SurfaceMetrics EvaluateSurfaces(const SurfaceInputs& inputs, const Trajectory& truth,
                                const Alignment& alignment, const CloudMetricOptions& options,
                                const VisibilityOptions& visibility, const Progress& progress) {
  visibility.Check();
  const TriangleTree surfaces(ReadSurfaces(inputs.true_surfaces));
  const std::vector<ReferenceView> views =
      ReferenceViews(surfaces, truth, TrueRig(inputs), visibility, progress.Part(0, kCast));
  SurfaceMetrics metrics;
  if (!inputs.cloud.empty()) {
    const EvaluatedCloud cloud = Aligned(alignment, ReadEvaluatedCloud(inputs.cloud));
    metrics.cloud = EvaluateCloud(surfaces, SeenSurfaces(views, visibility.cell_m), cloud, options);
  }
  if (!inputs.occupancy.empty()) {
    metrics.occupancy = EvaluateOccupancy(surfaces, views, OccupancyMap::Read(inputs.occupancy),
                                          alignment, progress.Part(kCast, 1));
  }
  return metrics;
}

std::string SurfaceTable(const SurfaceInputs& inputs, const SurfaceMetrics& metrics,
                         const CloudMetricOptions& options) {
  std::string text = fmt::format("surfaces  {}\n", inputs.true_surfaces);
  if (metrics.cloud) text += CloudTable(inputs, *metrics.cloud, options);
  if (metrics.occupancy) text += OccupancyTable(inputs, *metrics.occupancy);
  return text;
}

Json SurfaceJson(const SurfaceInputs& inputs, const SurfaceMetrics& metrics,
                 const CloudMetricOptions& options) {
  Json json = {{"true_surfaces", inputs.true_surfaces}};
  if (metrics.cloud) {
    json["cloud"] = {{"file", inputs.cloud},
                     {"points", metrics.cloud->points},
                     {"filled", metrics.cloud->filled},
                     {"filled_seen", metrics.cloud->filled_seen},
                     {"rms_m", metrics.cloud->rms_m}};
    for (const CloudScore& score : metrics.cloud->scores) {
      json["cloud"]["scores"].push_back(ScoreJson(score, options));
    }
  }
  if (metrics.occupancy) {
    json["occupancy"] = OccupancyJson(*metrics.occupancy);
    json["occupancy"]["file"] = inputs.occupancy;
  }
  return json;
}

}  // namespace slcmap
