// The first messages of topics, to tell by what they are.
#pragma once

#include <cstddef>
#include <map>
#include <opencv2/core/types.hpp>
#include <optional>
#include <string>
#include <vector>

#include "data/bag/bag.h"
#include "data/bag/messages.h"
#include "data/rig/topics.h"

namespace slcmap::inline data {

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
