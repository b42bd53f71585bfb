// How the rig moved between pairs of images, by the images alone, beside what poses say of it.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "data/core/progress.h"
#include "data/io/trajectory.h"
#include "data/source/sequence.h"
#include "mapping/views/view.h"

namespace slcmap::inline mapping {

// A movement of the IMU between two stamps.
struct BodyStep {
  int64_t from_ns = 0, to_ns = 0;
  RigidTransform T_from_to;  // metres
  // How well it is known; 0 of exact ones.
  double turn_sigma_rad = 0, way_sigma_m = 0;
};

// Pairs of images that are about `spacing_s` apart, evenly over the recording, at most 40; of those
// with stamps among `preferred_ns` (sorted), where these are enough.
std::vector<std::pair<size_t, size_t>> PairsToCompare(const std::vector<StereoEntry>& images,
                                                      const std::vector<int64_t>& preferred_ns,
                                                      double spacing_s);

// The movement between images of each pair that tell it: features are matched wherever they are
// (ORB, E. Rublee et al., ICCV 2011), placed by the first's stereo depth, and the second's pose is
// found by them. The same on any number of threads. Throws StoppedError when progress says so.
std::vector<BodyStep> StepsOfImages(const Sequence& recording,
                                    const std::vector<std::pair<size_t, size_t>>& pairs,
                                    const Progress& progress = {});

inline constexpr double kStepOfPoses_s = 0.45, kMostStepsApart = 2.5;  // spacing, and times it
inline constexpr int kLeastSteps = 6;                                  // that tell anything
inline constexpr double kTurnSigma_rad = 0.006, kWaySigma_m = 0.02;    // of a step, about
inline constexpr double kMostStepSigmas = 8;                           // that a step costs
inline constexpr double kMuchBetter = 0.5;                             // of what a reading costs

// How far poses are off known movements: medians over these.
struct PoseOff {
  int steps = 0;  // with a pose at both ends
  double turn_rad = 0, way_m = 0;
  double cost = 0;  // mean of both in standard deviations, at most kMostStepSigmas a step
};

// A known movement and what poses say of it.
struct StepPair {
  BodyStep known;
  RigidTransform posed;
  Eigen::Quaterniond R_world_to = Eigen::Quaterniond::Identity();  // of the poses
};

// Of the steps with poses at both ends, whose stamps are `offset_ns` before the steps'.
std::vector<StepPair> PairsAt(const Trajectory& trajectory, const std::vector<BodyStep>& steps,
                              int64_t offset_ns);

// By how much the posed ways are to be multiplied: the median, by the known lengths. 1, and an
// infinite sigma, where too few steps tell it.
double EstimateScale(const std::vector<StepPair>& pairs, double* sigma);

PoseOff ComputePoseOffsets(const std::vector<StepPair>& pairs, double scale);

}  // namespace slcmap::mapping
