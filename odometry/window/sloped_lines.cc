#include "odometry/window/sloped_lines.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "odometry/window/line_followers.h"
#include "odometry/window/line_landmarks.h"
#include "odometry/window/line_ties.h"
#include "odometry/window/line_triangulation.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

std::optional<FittedLine> FitFreeLine(const LineLandmarkOptions& options, const CostModel& model,
                                      LineLandmark line) {
  if (!line.estimated && !options.anchor_at_origin) {
    line.anchor_world = WorldFromLeftCamera(*line.frames.front(), model.geometry).translation;
  }
  const auto fit = TriangulateGeneralLine(ObservationsOf(line), line.anchor_world,
                                          model.Corrected(model.lines), options.triangulation);
  if (!fit) return std::nullopt;
  line.block = fit->block;
  if (!FitsItsObservations(line, options.max_new_chi2, model)) return std::nullopt;
  const PointAndDirection in_world = line.InWorld();
  LineExtent extent;
  for (const FrameState* frame : line.frames) {
    const auto seen = ExtentAlong(in_world, frame->lines.at(line.id).left,
                                  WorldFromLeftCamera(*frame, model.geometry));
    if (seen) extent.Add(seen->first, seen->second);
  }
  if (extent.empty()) return std::nullopt;
  FittedLine out;
  out.anchor_world = line.anchor_world;
  out.block = fit->block;
  out.line.id = line.id;
  out.line.direction_world = in_world.direction_world;
  out.line.direction_covariance_rad2 = fit->direction_covariance;
  out.line.middle_world =
      in_world.point_world + 0.5 * (extent.from_m() + extent.to_m()) * in_world.direction_world;
  out.line.length_m = extent.to_m() - extent.from_m();
  return out;
}

// The slope that a line follows; nothing where it follows none.
SlopeState* SlopeOfLine(const SlopeOptions& options, const FreeLine& line, double deviation_rad,
                        WindowState* window) {
  SlopeState* best = nullptr;
  double least = options.max_sigmas * options.max_sigmas;
  for (SlopeState& slope : window->slopes) {
    if (slope.withdrawn) continue;
    const auto off = SquaredSigmasOff(options, line, slope.angles_rad, deviation_rad);
    if (!off || *off > least) continue;
    best = &slope;
    least = *off;
  }
  return best;
}

// Lines of a slope all run up it: lines that are the same edge have to point the same way.
GeneralLineBlock UpwardBlock(const FittedLine& fit) {
  const PointAndDirection in_world = GeneralLineFromBlock(fit.anchor_world, fit.block.data());
  const double sign = in_world.direction_world.z() < 0 ? -1 : 1;
  return GeneralLineThrough(fit.anchor_world, in_world.point_world,
                            sign * in_world.direction_world);
}

}  // namespace

std::vector<FittedLine> FitFreeLines(const LineLandmarkOptions& options, const FrameState& frame,
                                     const CostModel& model, const WindowState& window) {
  std::vector<FittedLine> fits;
  for (const auto& [id, line] : window.lines) {
    if (line.retired || line.IsStructural() || !frame.lines.contains(id)) continue;
    if (static_cast<int>(line.frames.size()) < options.min_general_keyframes) continue;
    if (auto fit = FitFreeLine(options, model, line)) fits.push_back(std::move(*fit));
  }
  return fits;
}

std::vector<FreeLine> FollowSlopes(const SlopeOptions& options,
                                   const std::vector<Vector3d>& axes_world,
                                   const std::vector<FittedLine>& fits,
                                   const LineDeviations& deviations, WindowState* window) {
  std::vector<FreeLine> others;
  for (const FittedLine& fit : fits) {
    SlopeState* slope = nullptr;
    if (MaySlope(options, fit.line, axes_world, {})) {
      slope = SlopeOfLine(options, fit.line, options.search_sigma_rad, window);
    }
    if (!slope) {
      others.push_back(fit.line);
      continue;
    }
    LineLandmark& line = window->lines.at(fit.line.id);
    line.axis = LineAxis::kSloped;
    line.slope = slope;
    line.placed_by.reset();
    line.deviation_sigma_rad = deviations.Of(line.axis).OfLine(line.id);
    if (line.estimated) continue;
    line.anchor_world = fit.anchor_world;
    line.block = UpwardBlock(fit);
    line.estimated = true;
  }
  return others;
}

std::unordered_set<int64_t> RejectLinesOffSlope(const LineDeviations& deviations,
                                                WindowState* window) {
  const double max_deviation_rad = deviations.Of(LineAxis::kSloped).max_deviation_rad();
  std::unordered_set<int64_t> outliers;
  for (auto& [id, line] : window->lines) {
    if (!line.estimated || line.retired || !line.slope) continue;
    if (!IsOffAxis(line, max_deviation_rad)) continue;
    ++line.slope->lines_given_up;
    outliers.insert(id);
    Retire(&line);
  }
  return outliers;
}

std::unordered_set<int64_t> WithdrawSlopes(const SlopeOptions& options, WindowState* window) {
  const auto name = [](const SlopeState& slope) {
    return fmt::format("slope {}, {:.2f} degrees", slope.index, slope.angles_rad[1] * 180 / M_PI);
  };
  return WithdrawFollowed(options, &LineLandmark::slope, &window->slopes, name, window);
}

std::vector<SlopeBlock> SlopesOf(const WindowState& window) {
  std::vector<SlopeBlock> slopes;
  for (const SlopeState& slope : window.slopes) slopes.push_back(slope.angles_rad);
  return slopes;
}

}  // namespace slcmap
