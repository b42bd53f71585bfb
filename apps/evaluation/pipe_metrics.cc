#include "apps/evaluation/pipe_metrics.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/evaluation/report.h"

namespace slcmap::inline evaluation {
namespace {

using Eigen::Vector3d;

constexpr double kMinSeen_m = 0.5;           // of a true pipe that counts as one to be found
constexpr double kPipeMaxDistance_m = 0.05;  // between the axes, where both are
constexpr double kPipeMaxTurn_rad = 0.0873;  // 5 degrees
constexpr double kMaxRadiusError = 0.15;     // of the true radius

// How far the axis of a mapped pipe is from a true one where both are; nothing where they are
// nowhere side by side, or not parallel.
std::optional<double> AxisDistance(const TruePipe& truth, const MapPipe& pipe) {
  const Vector3d along = (truth.end_world - truth.start_world).normalized();
  const Vector3d way = pipe.end_world - pipe.start_world;
  const double length_m = (truth.end_world - truth.start_world).norm();
  if (std::abs(along.dot(way.normalized())) < std::cos(kPipeMaxTurn_rad)) return std::nullopt;
  const double start_m = along.dot(pipe.start_world - truth.start_world);
  const double end_m = along.dot(pipe.end_world - truth.start_world);
  const double from_m = std::max(0.0, std::min(start_m, end_m));
  const double to_m = std::min(length_m, std::max(start_m, end_m));
  if (to_m <= from_m) return std::nullopt;
  const double share = (0.5 * (from_m + to_m) - start_m) / (end_m - start_m);
  const Vector3d middle = pipe.start_world + share * way;
  return (middle - truth.start_world).cross(along).norm();
}

bool HasRadius(const TruePipe& truth, const MapPipe& pipe) {
  return std::abs(pipe.radius_m - truth.radius_m) <= kMaxRadiusError * truth.radius_m;
}

// The pipe that is nearest to a true one, of those with its axis and perhaps its radius.
struct Match {
  const MapPipe* pipe = nullptr;
  double distance_m = 0;
};
std::optional<Match> FindMatch(const TruePipe& truth, const std::vector<MapPipe>& pipes,
                               bool with_radius) {
  std::optional<Match> best;
  for (const MapPipe& pipe : pipes) {
    if (with_radius && !HasRadius(truth, pipe)) continue;
    const auto distance_m = AxisDistance(truth, pipe);
    if (!distance_m || *distance_m > kPipeMaxDistance_m) continue;
    if (!best || *distance_m < best->distance_m) best = {&pipe, *distance_m};
  }
  return best;
}

bool IsTrue(const MapPipe& pipe, const std::vector<TruePipe>& truth) {
  return std::ranges::any_of(truth, [&](const TruePipe& true_pipe) {
    return FindMatch(true_pipe, {pipe}, true).has_value();
  });
}

}  // namespace

std::vector<MapPipe> Aligned(const Alignment& alignment, std::vector<MapPipe> pipes) {
  for (MapPipe& pipe : pipes) {
    pipe.start_world = alignment.Position(pipe.start_world);
    pipe.end_world = alignment.Position(pipe.end_world);
    pipe.radius_m *= alignment.scale;
  }
  return pipes;
}

PipeMetrics EvaluatePipes(const std::vector<TruePipe>& truth, const std::vector<MapPipe>& pipes) {
  PipeMetrics metrics;
  std::vector<double> radius_errors_m, distances_m;
  for (const TruePipe& pipe : truth) {
    if (pipe.SeenLength_m() < kMinSeen_m) continue;
    ++metrics.pipes;
    metrics.seen_m += pipe.SeenLength_m();
    metrics.found_axes += FindMatch(pipe, pipes, false).has_value();
    const auto match = FindMatch(pipe, pipes, true);
    if (!match) continue;
    ++metrics.found;
    metrics.found_m += pipe.SeenLength_m();
    radius_errors_m.push_back(std::abs(match->pipe->radius_m - pipe.radius_m));
    distances_m.push_back(match->distance_m);
  }
  metrics.mapped = std::ssize(pipes);
  metrics.false_pipes =
      std::ranges::count_if(pipes, [&](const MapPipe& pipe) { return !IsTrue(pipe, truth); });
  metrics.radius_median_m = QuantileFigure(radius_errors_m, 0.5);
  metrics.radius_95_m = QuantileFigure(radius_errors_m, 0.95);
  metrics.axis_median_m = QuantileFigure(distances_m, 0.5);
  return metrics;
}

std::string PipeTable(const ComparedFiles& inputs, const PipeMetrics& metrics) {
  return fmt::format(
      "pipes     {}, {}\n\n"
      "found     {} of {} ({} %), {:.1f} of {:.1f} m that were seen; {} by their axes alone\n"
      "false     {} of {} mapped\n"
      "radius    {} m median, {} m 95 %; axis {} m median\n",
      inputs.truth, inputs.mapped, metrics.found, metrics.pipes,
      FigureText(100 * ComputeShare(metrics.found, metrics.pipes), 1), metrics.found_m,
      metrics.seen_m, metrics.found_axes, metrics.false_pipes, metrics.mapped,
      FigureText(metrics.radius_median_m, 4), FigureText(metrics.radius_95_m, 4),
      FigureText(metrics.axis_median_m, 4));
}

nlohmann::ordered_json PipeJson(const ComparedFiles& inputs, const PipeMetrics& metrics) {
  return {{"pipes", inputs.mapped},
          {"true_pipes", inputs.truth},
          {"true", metrics.pipes},
          {"found", metrics.found},
          {"found_axes", metrics.found_axes},
          {"mapped", metrics.mapped},
          {"false", metrics.false_pipes},
          {"seen_m", metrics.seen_m},
          {"found_m", metrics.found_m},
          {"radius_error_median_m", metrics.radius_median_m},
          {"radius_error_95_m", metrics.radius_95_m},
          {"axis_error_median_m", metrics.axis_median_m}};
}

}  // namespace slcmap::evaluation
