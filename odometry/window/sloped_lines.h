// What happens to the lines of a window that follow a slope: they are found among those that follow
// no axis, tied to what they share, and judged.
#pragma once

#include <map>
#include <unordered_set>
#include <vector>

#include "odometry/structure/options.h"
#include "odometry/window/options.h"
#include "odometry/structure/building_deviation.h"
#include "odometry/structure/slope_detector.h"
#include "odometry/window/problem_builder.h"

namespace slcmap {

// A line that follows no axis, as its observations in the window have it.
struct FittedLine {
  FreeLine line;
  Eigen::Vector3d anchor_world = Eigen::Vector3d::Zero();
  GeneralLineBlock block{};
};

// Those that the frame has seen too, as far as their observations tell where they are.
std::vector<FittedLine> FitFreeLines(const LineLandmarkOptions& options, const FrameState& frame,
                                     const CostModel& model, const WindowState& window);

// Lets those that follow a known slope, and none of the building's axes (unit), do so; what is not
// yet estimated is from now on. Returns the others.
std::vector<FreeLine> FollowSlopes(const SlopeOptions& options,
                                   const std::vector<Eigen::Vector3d>& axes_world,
                                   const std::vector<FittedLine>& fits,
                                   const LineDeviations& deviations, WindowState* window);

// Retires the lines that are further off their slope than lines deviate, which speaks against the
// slope; returns their ids.
std::unordered_set<int64_t> RejectLinesOffSlope(const LineDeviations& deviations,
                                                WindowState* window);

// Withdraws the slopes most of whose lines turned out to be off them, and retires the rest of these
// lines. Returns the ids of these.
std::unordered_set<int64_t> WithdrawSlopes(const SlopeOptions& options, WindowState* window);

// What the angles of all slopes are, of those that were withdrawn too.
std::vector<SlopeBlock> SlopesOf(const WindowState& window);

}  // namespace slcmap
