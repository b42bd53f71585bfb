// Poses in axes that no option takes: of a body that is turned, or left-handed.
#pragma once

#include <string>
#include <vector>

#include "data/pose_form.h"
#include "mapping/given_poses/step_pairs.h"

namespace slcmap {

struct PosesToTry {
  std::string sensor;           // that they may be of, for the words
  Trajectory poses;             // without offset and scale
  std::vector<BodyStep> steps;  // of the sensor
};

// What is wrong with the axes of body or world; "" where none that lie along others make the poses
// agree with the steps, twice as well as they do `otherwise`.
std::string WordsOfOtherAxes(const std::vector<PosesToTry>& readings, const PoseForm& given,
                             const PoseOff& otherwise);

}  // namespace slcmap
