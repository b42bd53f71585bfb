// How the images of a recording turn and move, by features that are followed through them.
#pragma once

#include <cstdint>
#include <vector>

#include "data/check/view_geometry.h"
#include "data/core/progress.h"
#include "data/source/sequence_source.h"

namespace slcmap::inline data {

// The rotation of the left camera between two of its images, on the camera's clock.
struct ImageTurn {
  int64_t from_ns = 0, to_ns = 0;
  Eigen::Vector3d turn_rad = Eigen::Vector3d::Zero();    // rotation vector of R_first_second
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // of turn_rad, in rad^2
};

// What tells the movement of the left camera between two stereo pairs once its rotation is known.
struct StereoStep {
  int64_t from_ns = 0, to_ns = 0;
  std::vector<PlacedRay> rays;
};

struct ImageMotion {
  std::vector<ImageTurn> turns;
  std::vector<StereoStep> steps;  // none of one camera
};

// Adds the motion in other parts of the same recording.
void Append(const ImageMotion& other, ImageMotion* motion);

// A range of pairs or samples, [first, end).
struct IndexRange {
  size_t first = 0, end = 0;
};

inline constexpr double kLookedAt_s = 16;  // of a recording, where its motion is judged

// The parts of a recording in which the gyroscope changes most, in the order of time, of about
// `duration_s` in all; after those of about `skipped_s` in which it changes more.
std::vector<IndexRange> LiveliestParts(const SourceInfo& info, const std::vector<ImuSample>& imu,
                                       double duration_s, double skipped_s = 0);

// Follows features through those parts, at the images' rate where that is below 40 Hz. `rig` is
// what points are placed with. Throws StoppedError where progress ends it.
ImageMotion FollowImages(const SequenceSource& source, const Rig& rig,
                         const std::vector<IndexRange>& parts, const Progress& progress);

}  // namespace slcmap::data
