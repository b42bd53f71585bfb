// Topics of a bag that are a rig's.
#pragma once

#include <string>
#include <vector>

#include "data/bag/bag.h"
#include "data/bag/messages.h"

namespace slcmap::inline data {

// Names of topics.
struct RecordingTopics {
  std::string left, right;                // "" of the right where there is one camera
  std::string gyro, accel;                // the same where one topic has both
  std::string profile = {};               // that told them (config/profiles), "" where none did
  std::vector<std::string> reasons = {};  // why these, in words
};

// Raw or compressed.
inline bool IsImageTopic(const BagTopic& topic) {
  return topic.type == RosImage::kType || topic.type == RosCompressedImage::kType;
}

inline bool IsImuTopic(const BagTopic& topic) { return topic.type == RosImu::kType; }

}  // namespace slcmap::data
