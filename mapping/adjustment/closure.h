// Places that were visited twice, recognised by points and by the edges of the building, and what
// several matches say in common of how far the visits are shifted.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/core/progress.h"
#include "mapping/adjustment/adjustment_state.h"
#include "mapping/views/view.h"

namespace slcmap::inline mapping {

// A shift of the later visit against the earlier one: x, y, z in metres, and a turn about the
// vertical in rad.
using Shift = Eigen::Vector4d;

// A thing seen at the earlier visit, and where it may have been seen again: alternatives that look
// alike. The offset b of the right one fits by_shift * shift = b; both in units of the distance at
// which one is taken to fit.
struct ShiftVote {
  Eigen::Matrix<double, 2, 4> by_shift;
  std::vector<Eigen::Vector2d> alternatives;
};

// How far apart visits may be as odometry knows them: standard deviations.
struct ShiftSigma {
  double position_m = 0;
  double yaw_rad = 0;
};

struct Agreement {
  Shift shift = Shift::Zero();
  std::vector<int> chosen;  // of each vote the alternative that fits, -1 where none does
  int votes = 0;            // that fit
  int runner_up = 0;        // of the best shift that is another one: see FindAgreement()
};

// The shift that most votes fit, found from pairs of them (a fixed sequence of pairs, so that the
// same votes give the same answer), and refined on those that fit. What the votes do not tell of a
// shift is taken to be zero with the given standard deviations; shifts beyond three of them are
// not looked at. Another shift is one that lies more than min_displacement_m away.
Agreement FindAgreement(const std::vector<ShiftVote>& votes, const ShiftSigma& sigma,
                        double min_displacement_m);

// A point of an earlier visit that a keyframe of a later one sees; indices into the state.
struct PointMatch {
  size_t point = 0;
  size_t frame = 0;
  Eigen::Vector2d left = Eigen::Vector2d::Zero();  // on the plane z = 1
};

// Two lines that are one edge, seen at an earlier and at a later visit.
struct EdgeMatch {
  size_t older = 0, newer = 0;
};

struct Closure {
  size_t older_frame = 0, newer_frame = 0;  // of the visits, one keyframe each
  Shift shift = Shift::Zero();              // of the later visit, as the matches have it
  std::vector<PointMatch> points;
  std::vector<EdgeMatch> edges;
  bool taken_back = false;
};

// Lengths of the path up to each keyframe, from the start of its segment.
std::vector<double> PathLengths(const AdjustmentState& state);

// What odometry leaves open over a path of some length.
ShiftSigma SigmaOver(double path_m, const ClosureOptions& options);

// Whether the votes for a shift are so many, and so many more than those for another.
bool IsUnique(const Agreement& agreement, int min_votes);

// Lines of one axis that lie near each other across it and were seen at different visits are
// candidates for one edge; those of which enough agree on one shift between the visits become a
// closure. Lines are merged by place and axis alone, whatever direction they are seen from.
std::vector<Closure> FindEdgeClosures(const AdjustmentState& state, const ClosureOptions& options);

// Places that are recognised by how points look.

// Keyframes that look at a place from nearly where an earlier one did: the points of the earlier
// one are searched in the later image about where the state has them, as far as odometry's
// uncertainty goes, by the correlation of their patches. Keyframes in which enough points agree on
// one shift, and whose neighbours find the same, become closures. `images` are those of the state's
// keyframes, in their order; `geometry` is that of the rectified rig that the run's observations
// are told in. Throws StoppedError when progress says so.
std::vector<Closure> FindPointClosures(const AdjustmentState& state, const ViewImages& images,
                                       const StereoGeometry& geometry,
                                       const ClosureOptions& options,
                                       const Progress& progress = {});

}  // namespace slcmap::mapping
