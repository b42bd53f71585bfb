#include "data/rig/peek.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "data/core/error.h"

namespace slcmap::inline data {
namespace {

constexpr int64_t kMostPeeked = 20'000;  // messages: a topic may have none

std::optional<ImageLook> LookAtFile(const RosCompressedImage& image) {
  const size_t size = image.data.bytes.size();
  if (size == 0) return std::nullopt;
  const cv::Mat bytes(1, static_cast<int>(size), CV_8U,
                      const_cast<std::byte*>(image.data.bytes.data()));
  try {
    const cv::Mat decoded = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
    if (decoded.empty()) return std::nullopt;
    return ImageLook{decoded.size(), image.format};
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
}

}  // namespace

std::string WithoutCompressed(const std::string& name) {
  const std::string suffix = kCompressedSuffix;
  return name.ends_with(suffix) ? name.substr(0, name.size() - suffix.size()) : name;
}

std::string ViewerStream(const std::string& topic) {
  for (const std::string_view ending : {"/image/data", "/imu/data"}) {
    const bool is_viewers = topic.starts_with("/device_") && topic.ends_with(ending);
    if (is_viewers) return topic.substr(0, topic.size() - ending.size());
  }
  return "";
}

const BagTopic* FindTopicNamed(const Bag& bag, const std::string& name) {
  const auto topic = std::ranges::find_if(bag.topics(), [&](const BagTopic& known) {
    return known.name == name && known.messages != 0;
  });
  return topic == bag.topics().end() ? nullptr : &*topic;
}

std::map<std::string, FirstMessage> ReadFirstMessages(const std::vector<std::string>& names,
                                                      Bag* bag) {
  std::map<std::string, FirstMessage> first;
  std::vector<uint32_t> chosen;
  std::set<std::string> expected;
  for (const std::string& name : names) {
    if (FindTopicNamed(*bag, name) != nullptr) expected.insert(name);
  }
  for (uint32_t i = 0; i < bag->topics().size(); ++i) {
    const BagTopic& topic = bag->topics()[i];
    if (topic.messages != 0 && expected.count(topic.name) > 0) chosen.push_back(i);
  }
  if (chosen.empty()) return first;
  int64_t seen = 0;
  bag->Visit(chosen, 0, [&](const BagPlace& place, BagBytes bytes) {
    const BagTopic& topic = bag->topics()[place.topic];
    first.try_emplace(topic.name,
                      FirstMessage{topic.type, topic.encoding, {bytes.begin(), bytes.end()}});
    return first.size() < expected.size() && ++seen < kMostPeeked;
  });
  return first;
}

std::optional<ImageLook> LookAtImage(const FirstMessage& message) {
  try {
    if (message.type == RosCompressedImage::kType) {
      return LookAtFile(DecodeMessage<RosCompressedImage>(message.encoding, message.bytes));
    }
    const auto image = DecodeMessage<RosImage>(message.encoding, message.bytes);
    return ImageLook{{static_cast<int>(image.width_px), static_cast<int>(image.height_px)},
                     image.encoding};
  } catch (const DataError&) {
    return std::nullopt;
  }
}

}  // namespace slcmap::data
