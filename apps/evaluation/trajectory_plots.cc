#include "apps/evaluation/trajectory_plots.h"

#include "apps/evaluation/svg_plot.h"
#include "data/file.h"

namespace slcmap {
namespace {

constexpr char kPlotTruthColour[] = "#888888";
constexpr char kEstimateColour[] = "#d03020";
constexpr char kRotationColour[] = "#2060c0";

// Both trajectories seen along one axis of the true world; `vertical` is the world axis that is
// drawn upwards.
SvgPlot TrajectoryView(const TrajectoryMetrics& metrics, const std::string& title, int vertical,
             const std::string& y_label) {
  SvgPlot plot{title, "x [m]", y_label, true, {}};
  SvgSeries truth{"truth", kPlotTruthColour, {}}, estimate{"estimate", kEstimateColour, {}};
  for (const AssociatedPose& pose : metrics.poses) {
    const Eigen::Vector3d& t = pose.T_world_truth.translation;
    const Eigen::Vector3d e =
        metrics.absolute.front().alignment.Position(pose.T_world_estimate.translation);
    truth.points.emplace_back(t.x(), t[vertical]);
    estimate.points.emplace_back(e.x(), e[vertical]);
  }
  plot.series = {truth, estimate};
  return plot;
}

SvgPlot ErrorOverTime(const TrajectoryMetrics& metrics) {
  const AbsoluteError& error = metrics.absolute.front();
  SvgPlot plot{"Error after alignment by position and yaw", "time [s]", "error", false, {}};
  SvgSeries position{"position [cm]", kEstimateColour, {}},
      rotation{"rotation [deg]", kRotationColour, {}};
  for (std::size_t i = 0; i < metrics.poses.size(); ++i) {
    const double time_s = ToSeconds(metrics.poses[i].stamp_ns - metrics.poses.front().stamp_ns);
    position.points.emplace_back(time_s, 100 * error.position_errors_m[i]);
    rotation.points.emplace_back(time_s, error.rotation_errors_deg[i]);
  }
  plot.series = {position, rotation};
  return plot;
}

}  // namespace

std::vector<std::string> WriteTrajectoryPlots(const std::string& folder,
                                              const TrajectoryMetrics& metrics) {
  MakeFolder(folder);
  const std::vector<std::pair<std::string, SvgPlot>> plots = {
      {folder + "/top.svg", TrajectoryView(metrics, "Seen from above", 1, "y [m]")},
      {folder + "/side.svg", TrajectoryView(metrics, "Seen from the side", 2, "z [m]")},
      {folder + "/error.svg", ErrorOverTime(metrics)}};
  std::vector<std::string> paths;
  for (const auto& [path, plot] : plots) {
    WriteFile(path, DrawSvg(plot));
    paths.push_back(path);
  }
  return paths;
}

}  // namespace slcmap
