// Chooses the topics of a bag that are a rig's; and the first messages of topics, to tell by what
// they are.
#pragma once

#include <cstddef>
#include <map>
#include <opencv2/core/types.hpp>
#include <optional>
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

inline constexpr const char* kCompressedSuffix = "/compressed";

// A name without what says that images are compressed.
std::string WithoutCompressed(const std::string& name);

// How RealSense Viewer names what belongs to a topic's stream; "" of others' topics.
std::string ViewerStream(const std::string& topic);

// Of a topic with messages; nullptr where there is none of this name.
const BagTopic* FindTopicNamed(const Bag& bag, const std::string& name);

// A message with the layout of its topic.
struct FirstMessage {
  std::string type;
  BagEncoding encoding = BagEncoding::kOther;
  std::vector<std::byte> bytes;
};

// By the names of topics; those that have none, or none among the first thousands of messages of
// these, are left out.
std::map<std::string, FirstMessage> ReadFirstMessages(const std::vector<std::string>& names,
                                                      Bag* bag);

// Nothing where there is no such message, or it cannot be decoded.
template <typename Message>
std::optional<Message> DecodeFirst(const std::map<std::string, FirstMessage>& messages,
                                   const std::string& name) {
  const auto message = messages.find(name);
  if (message == messages.end()) return std::nullopt;
  try {
    return DecodeMessage<Message>(message->second.encoding, message->second.bytes);
  } catch (const DataError&) {
    return std::nullopt;
  }
}

// What an image is.
struct ImageLook {
  cv::Size size_px;
  std::string encoding;  // or the format of a compressed one
};

// Nothing where it cannot be decoded.
std::optional<ImageLook> LookAtImage(const FirstMessage& message);

}  // namespace slcmap::data
