// Which topics of a bag are a rig's.
#pragma once

#include <string>
#include <vector>

namespace slcmap::inline data {

// Names of topics.
struct RecordingTopics {
  std::string left, right;                // "" of the right where there is one camera
  std::string gyro, accel;                // the same where one topic has both
  std::string profile = {};               // that told them (config/profiles), "" where none did
  std::vector<std::string> reasons = {};  // why these, in words
};

}  // namespace slcmap::data
