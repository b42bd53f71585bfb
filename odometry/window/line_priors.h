// How lines that may deviate from the axes of the building, or follow a slope, are tied to what
// they share, and whether points that follow a line lie on it in space.
#pragma once

#include <cstdint>
#include <unordered_set>
#include <vector>

#include "odometry/structure/building_deviation.h"
#include "odometry/structure/options.h"
#include "odometry/structure/points_on_lines.h"
#include "odometry/structure/slope_detector.h"
#include "odometry/window/landmark_information.h"
#include "odometry/window/options.h"
#include "odometry/window/problem.h"

namespace slcmap::inline odometry {

// Whether the angle between a line that may deviate and its axis or slope is larger than a limit.
bool IsOffAxis(const LineLandmark& line, double max_deviation_rad);

// Ties the directions of lines that may deviate from their axes by how much the building is known
// to, and to what they share with their neighbours.
void AddDirectionPriors(const LineDeviations& deviations, WindowState* window);

// Shared deviations that no line will have any more once those of `gone` are forgotten are added to
// the terms by what was known of them, and their blocks to the dropped ones; RemoveShared() erases
// them once these lines are.
void ReleaseShared(const std::unordered_set<int64_t>& gone, WindowState* window,
                   std::vector<Term>* terms, std::vector<double*>* dropped);
void RemoveShared(WindowState* window);

// Finishes lines, but those exactly along their axes, that would become longer than is taken for
// straight with what the newest frame sees. Returns their ids.
std::unordered_set<int64_t> FinishPieces(const LineDeviations& deviations, const CostModel& model,
                                         WindowState* window);

enum class Membership {
  kHolds,
  kOpen,  // what is known of the two does not yet tell
  kRefuted,
};

// Compares where the observations of a triangulated point alone have it with an estimated
// structural line. Where a nearer edge hides a line, their crossing is on the line in every image,
// and in the depth of neither; the place that its observations give is off the line as soon as it
// is well enough known to tell, or they do not agree on a place. Both are seen from the same poses,
// whose errors move them alike: how well poses are known is left out.
Membership JudgeMembership(const LineLandmarkOptions& options, const PointLandmark& point,
                           const LineLandmark& line, const CostModel& model, const Prior& prior);

// Whether a point's observations agree on one place, as they do not on what slides.
bool IsAtRest(const PointPlace& place);

// Gives each estimated structural line the points that belong to it: those that do in the images,
// and lie on it in space. Memberships that are refuted are released. Of points that have left the
// window those stay that the line had. Returns the lines that were placed through a point which is
// now refuted.
//
// A point is then in LineLandmark::points only where `memberships` has it as verified. What follows
// keeps it so, on both sides.
std::unordered_set<int64_t> UpdateMembers(const LineLandmarkOptions& options,
                                          const CostModel& model, PointsOnLines* memberships,
                                          WindowState* window);

// The points of a line that was merged go to the one that took it over, but for those that have
// been refuted there.
void MergeMembers(int64_t line_id, int64_t into_line_id, PointsOnLines* memberships,
                  WindowState* window);

// Takes points that turned out to be no landmarks from all lines.
void RemoveMembers(const std::unordered_set<int64_t>& point_ids, PointsOnLines* memberships,
                   WindowState* window);

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
std::vector<FreeLine> FollowSlopes(const std::vector<Eigen::Vector3d>& axes_world,
                                   const std::vector<FittedLine>& fits,
                                   const LineDeviations& deviations, WindowState* window);

// Retires the lines that are further off their slope than lines deviate, which speaks against the
// slope; returns their ids.
std::unordered_set<int64_t> RejectLinesOffSlope(const LineDeviations& deviations,
                                                WindowState* window);

// Withdraws the slopes most of whose lines turned out to be off them, and retires the rest of these
// lines. Returns the ids of these.
std::unordered_set<int64_t> RejectSlopes(WindowState* window);

// What the angles of all slopes are, of those that were withdrawn too.
std::vector<SlopeBlock> CollectSlopes(const WindowState& window);

}  // namespace slcmap::odometry
