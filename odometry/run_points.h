// What is reported of a run's points.
#pragma once

#include <cstdint>
#include <vector>

#include "odometry/run.h"

namespace slcmap {

// How many points keyframes saw, and how many of them a single one: where that is most of them,
// there was little to see but noise, or they were lost from keyframe to keyframe.
struct PointLives {
  int64_t points = 0;
  int64_t seen_once = 0;
};
PointLives MeasurePointLives(const std::vector<Keyframe>& keyframes);

}  // namespace slcmap
