// Chooses the topics of a bag that are a rig's.
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
  std::vector<std::string> others = {};   // images of the third camera on

  // By camera.
  std::vector<std::string> Images() const {
    std::vector<std::string> images = {left};
    if (!right.empty()) images.push_back(right);
    images.insert(images.end(), others.begin(), others.end());
    return images;
  }
};

// Raw or compressed.
inline bool IsImageTopic(const BagTopic& topic) {
  return topic.type == RosImage::kType || topic.type == RosCompressedImage::kType;
}

inline bool IsImuTopic(const BagTopic& topic) { return topic.type == RosImu::kType; }

// The topics that `said` leaves out, with reasons. First by the profiles of known rigs, of which
// the nearest is taken. Else by types and names: the one pair of image topics whose names differ by
// left and right or by a number, of images of one size that are no depths, else the one image
// topic; with a pair, further topics whose names differ from it by a number alone; the one IMU
// topic, else those of a gyroscope and an accelerometer. Compressed images are taken where the same
// are not there otherwise. Throws ConfigError for a topic in `said` that is not there or of another
// type, and InputFault, with what is there and what to say, where none or several could be it;
// without `needs_imu` those of the IMU are "" then.
RecordingTopics ChooseTopics(Bag* bag, const RecordingTopics& said, bool needs_imu = true);

// Of the text left=/a,right=/b,other=/d,imu=/c, or gyro= and accel= instead of imu=, any of them
// left out; other= as often as there are further cameras. Throws ConfigError.
RecordingTopics ParseTopics(const std::string& text);

// Such a text.
std::string TopicsText(const RecordingTopics& topics);

}  // namespace slcmap::data
