// What is wrong with given poses as a whole: axes that no option takes, drifts of heading and
// changes of scale, and where up is in their world by what the images show.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "data/io/trajectory.h"
#include "data/source/sequence.h"
#include "mapping/external_poses/image_steps.h"

namespace slcmap::inline mapping {

// Poses of a file as those of one form.
struct Reading {
  PoseForm form;
  Trajectory poses;             // without offset and scale
  std::vector<BodyStep> steps;  // of the sensor
};

// What is wrong with the axes of body or world; "" where none that lie along others make the poses
// agree with the steps, twice as well as they do `otherwise`.
std::string WordsOfOtherAxes(const std::vector<Reading>& readings, const PoseForm& given,
                             const PoseOff& otherwise);

// Intervals of steps that poses are off, a drift of their heading, and a scale that is another from
// some step on: in words, with figures; "" where nothing is more than steps and good odometry
// are off. Steps that are not well known are left out. `who` is what they are by.
std::string WordsOfChange(std::vector<StepPair> pairs, double scale, const std::string& who);

// For recordings without an IMU: where the images' own up is far from z of the world, the direction
// near it that most length of edges follows. Nothing where the images are upright with z, or where
// edges do not tell.
std::optional<Eigen::Vector3d> UpByImages(const Sequence& recording, const Trajectory& trajectory);

}  // namespace slcmap::mapping
