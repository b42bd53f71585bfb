// Whether points that follow a line in the images lie on it in space.
#pragma once

#include <unordered_set>

#include "odometry/window/options.h"
#include "odometry/structure/points_on_lines.h"
#include "odometry/window/landmark_information.h"
#include "odometry/window/problem_builder.h"

namespace slcmap {

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
std::unordered_set<int64_t> AdoptMembers(const LineLandmarkOptions& options, const CostModel& model,
                                         PointsOnLines* memberships, WindowState* window);

// The points of a line that was merged go to the one that took it over, but for those that have
// been refuted there.
void MergeMembers(int64_t line_id, int64_t into_line_id, PointsOnLines* memberships,
                  WindowState* window);

// Takes points that turned out to be no landmarks from all lines.
void ForgetMembers(const std::unordered_set<int64_t>& point_ids, PointsOnLines* memberships,
                   WindowState* window);

}  // namespace slcmap
