// Known movements of a rig beside those that poses say of it.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "data/trajectory.h"
#include "mapping/given_poses/image_steps.h"

namespace slcmap {

inline constexpr int kLeastSteps = 6;                                // that tell anything
inline constexpr double kTurnSigma_rad = 0.006, kWaySigma_m = 0.02;  // of a step, about

// How far poses are off known movements: medians over these.
struct PoseOff {
  int steps = 0;  // with a pose at both ends
  double turn_rad = 0, way_m = 0;
  double cost = 0;  // mean of both in standard deviations, at most 8 for each step
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
double ScaleOf(const std::vector<StepPair>& pairs, double* sigma);

PoseOff OffOf(const std::vector<StepPair>& pairs, double scale);

}  // namespace slcmap
