// What of poses changes where they agree with known movements in the median.
#pragma once

#include <string>
#include <vector>

#include "mapping/given_poses/step_pairs.h"

namespace slcmap {

// Stretches of steps that poses are off, a drift of their heading, and a scale that is another from
// some step on: in words, with figures; "" where nothing is more than steps and good odometry
// are off. Steps that are not well known are left out. `who` is what they are by.
std::string WordsOfChange(std::vector<StepPair> pairs, double scale, const std::string& who);

}  // namespace slcmap
