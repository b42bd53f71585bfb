// What happens to the lines of a window: they are registered, classified, triangulated, judged,
// merged, predicted and described; and given up with their heading or slope.
#pragma once

#include <spdlog/spdlog.h>

#include <cstdint>
#include <map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "data/core/types.h"
#include "odometry/run/run.h"
#include "odometry/structure/building_deviation.h"
#include "odometry/structure/manhattan_detector.h"
#include "odometry/structure/points_on_lines.h"
#include "odometry/window/line_triangulation.h"
#include "odometry/window/options.h"
#include "odometry/window/problem.h"

namespace slcmap::inline odometry {

// The pose of a frame's camera.
RigidTransform WorldFromCamera(const FrameState& frame, const StereoGeometry& geometry, int camera);

// What the frames of the window saw of a line.
std::vector<PosedLineObservation> CollectObservations(const LineLandmark& line);

// Whether all but a few observations of a line that was just placed are near it.
bool FitsItsObservations(const LineLandmark& line, double max_new_chi2, const CostModel& model);

// Takes a line out of the cost, and its observations out of the window.
void Retire(LineLandmark* line);

// Adds the frame to every line that it measures; new lines are made. What it measures of finished
// ones is left out.
void RegisterLines(FrameState* frame, WindowState* window);

// Which lines a method estimates.
struct LineKinds {
  bool structural = false;  // along axes of the building
  bool general = false;     // of no axis
};

// Classifies and triangulates what is not yet estimated, where its observations allow it: from the
// views, or from a well known point that belongs to it in the images (SLC-VIO, section 3.6).
void EstimateLines(const LineLandmarkOptions& options, const LineKinds& kinds,
                   const LineClassifier& classifier, const PointsOnLines& memberships,
                   const LineDeviations& deviations, const CostModel& model, WindowState* window);

// Of lines whose points turned out not to belong to them: those that their views place too stay as
// they are, the others are retired. Returns the ids of these.
std::unordered_set<int64_t> RetireMisplaced(const LineLandmarkOptions& options,
                                            const std::unordered_set<int64_t>& ids,
                                            const CostModel& model, WindowState* window);

// Squared whitened residuals of one observation, left and right apart (right 0 where it was not
// seen).
std::pair<double, double> ObservationChi2(const LineLandmark& line, const FrameState& frame,
                                          const CostModel& model);

// Rejects the observations of a frame, not optimised yet, that are too far from where its estimated
// lines are expected: matched with another edge, they would move the frame.
void RejectLineMisfits(const LineLandmarkOptions& options, const CostModel& model,
                       FrameState* frame, WindowState* window);

// Rejects observations whose squared residual in one camera is above the limit, and retires the
// lines that have mostly such, whose median residual is too large, or that are off their axis (not
// those that are off a slope); returns the ids of these.
std::unordered_set<int64_t> RejectLineOutliers(const LineLandmarkOptions& options,
                                               const LineDeviations& deviations,
                                               const CostModel& model, WindowState* window);

// Withdraws the headings most of whose lines were given up, and retires the rest of these lines.
// Returns the ids of these.
std::unordered_set<int64_t> RejectHeadings(WindowState* window);

// Retires lines that are the same edge as an older one, which takes over their observations.
// Returns the ids of those retired, each with that of the older line.
std::map<int64_t, int64_t> MergeLines(const CostModel& model, WindowState* window);

// Takes in how far the newest frame saw its estimated lines, and all frames those just estimated.
void ExtendLines(const FrameState& newest, const CostModel& model, WindowState* window);

// The middle of what was seen of a line.
Eigen::Vector3d ComputeMiddle(const LineLandmark& line);

// A line as a run holds it, but for its segment and with the world counted in the segment. Its
// covariance is to be set.
Line Describe(const LineLandmark& line);

// A heading or a slope is withdrawn when so many lines, and this share of all that were taken to
// follow it, turned out not to.
inline constexpr int kMinGivenUpOfHeading = 8, kMinGivenUpOfSlope = 4;
inline constexpr double kMaxGivenUpShare = 0.7;

// Withdraws those of the window's headings or slopes that most of their lines were given up for,
// and retires the rest of these lines. `followed` is what of a line names the one that it follows,
// `name` what the log calls one. Returns the ids of the retired lines.
template <typename State, typename States, typename Name>
std::unordered_set<int64_t> RejectFollowed(int min_given_up, State* LineLandmark::*followed,
                                           States* states, const Name& name, WindowState* window) {
  std::map<const State*, std::vector<LineLandmark*>> followers;
  for (auto& [id, line] : window->lines) {
    if (line.estimated && !line.retired && line.*followed)
      followers[line.*followed].push_back(&line);
  }
  std::unordered_set<int64_t> retired;
  for (State& state : *states) {
    const int given_up = state.lines_given_up;
    const int all = state.lines_kept + given_up + static_cast<int>(followers[&state].size());
    if (state.withdrawn || given_up < min_given_up || given_up < kMaxGivenUpShare * all) {
      continue;
    }
    spdlog::warn("withdrew {}: {} of {} lines are off it", name(state), given_up, all);
    state.withdrawn = true;
    for (LineLandmark* line : followers[&state]) {
      Retire(line);
      retired.insert(line->id);
    }
  }
  return retired;
}

}  // namespace slcmap::odometry
