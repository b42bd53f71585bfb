#include "data/rig/topics.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "data/core/error.h"
#include "data/io/csv.h"
#include "data/rig/profile.h"

namespace slcmap::inline data {
namespace {

constexpr int64_t kMostBlank = 500;      // messages, while some say nothing yet
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

// Of a driver that has not read its calibration yet, or has no image yet.
bool IsBlank(const FirstMessage& message) {
  const auto first = std::map<std::string, FirstMessage>{{"", message}};
  if (message.type == RosImage::kType) {
    const auto image = DecodeFirst<RosImage>(first, "");
    return !image || image->width_px == 0;
  }
  if (message.type == RosCompressedImage::kType) {
    const auto image = DecodeFirst<RosCompressedImage>(first, "");
    return !image || image->data.bytes.empty();
  }
  if (message.type != RosCameraInfo::kType) return false;
  const auto info = DecodeFirst<RosCameraInfo>(first, "");
  return info && std::ranges::count(info->k, 0.0) == 9 && std::ranges::count(info->p, 0.0) == 12;
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
  int64_t seen = 0, after = 0;
  std::set<std::string> blank;
  bag->Visit(chosen, 0, [&](const BagPlace& place, BagBytes bytes) {
    const BagTopic& topic = bag->topics()[place.topic];
    const bool is_new = first.count(topic.name) == 0;
    if (is_new || blank.contains(topic.name)) {
      FirstMessage message{topic.type, topic.encoding, {bytes.begin(), bytes.end()}};
      const bool is_blank = IsBlank(message);
      if (is_blank) blank.insert(topic.name);
      if (!is_blank) blank.erase(topic.name);
      if (is_new || !is_blank) first[topic.name] = std::move(message);
    }
    if (first.size() < expected.size()) return ++seen < kMostPeeked;
    return !blank.empty() && ++after < kMostBlank;
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

namespace {

// What is there, as a message lists it: recorders of a whole robot write hundreds of others.
std::string ListTopics(const Bag& bag) {
  std::string text;
  size_t others = 0;
  for (const BagTopic& topic : bag.topics()) {
    if (!IsImageTopic(topic) && !IsImuTopic(topic)) {
      ++others;
      continue;
    }
    text += fmt::format("{}{} ({}{})", text.empty() ? "" : ", ", topic.name, topic.type,
                        topic.messages < 0 ? "" : fmt::format(", {}", topic.messages));
  }
  if (text.empty()) text = "none of images or an IMU";
  return others == 0 ? text : fmt::format("{}, and {} of other kinds", text, others);
}

constexpr const char* kSayTopics =
    "say which topics are the rig's: --topics left=/a,right=/b,imu=/c, without right= for one "
    "camera, other=/f for each further one, gyro=/d,accel=/e for two topics of an IMU";

[[noreturn]] void FailChoice(const Bag& bag, const std::string& what,
                             const std::string& remedy = kSayTopics) {
  const bool is_cut_off = bag.warnings().Count(kBagCutOff) > 0;
  throw InputFault(
      "bag_topics",
      fmt::format("{}: found {}{}, expected one rig's; there are {}", bag.path(), what,
                  is_cut_off ? ", and that the bag is cut off" : "", ListTopics(bag)),
      std::string(is_cut_off ? "copy the bag again from where it was recorded; where it is whole, "
                             : "") +
          remedy);
}

using IsOfType = bool (*)(const BagTopic&);

std::vector<std::string> FindNames(const Bag& bag, IsOfType is_of_type) {
  std::vector<std::string> names;
  for (const BagTopic& topic : bag.topics()) {
    if (is_of_type(topic) && topic.messages != 0) names.push_back(topic.name);
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  std::erase_if(names, [&](const std::string& name) {
    const std::string plain = WithoutCompressed(name);
    return plain != name && std::ranges::count(names, plain) > 0;
  });
  return names;
}

void RequireTopic(const Bag& bag, const std::string& name, IsOfType is_of_type,
                  const std::string& type) {
  if (name.empty()) return;
  const auto topic = std::ranges::find(bag.topics(), name, &BagTopic::name);
  if (topic != bag.topics().end() && is_of_type(*topic)) return;
  throw ConfigError(
      fmt::format("--topics: found {}, which is {} in {}, expected a topic of {}; there are {}",
                  name, topic == bag.topics().end() ? "not" : fmt::format("a {}", topic->type),
                  bag.path(), type, ListTopics(bag)));
}

// What the topic of the right camera may be called, where that of the left has this name.
std::vector<std::string> NamesOfRight(const std::string& left) {
  static constexpr std::array<std::pair<const char*, const char*>, 6> kSides = {
      {{"left", "right"}, {"Left", "Right"}, {"_l", "_r"}, {"0", "1"}, {"1", "2"}, {"A", "B"}}};
  std::vector<std::string> names;
  for (const auto& [of_left, of_right] : kSides) {
    const std::string word = of_left;
    for (size_t at = left.find(word); at != std::string::npos; at = left.find(word, at + 1)) {
      std::string name = left;
      names.push_back(name.replace(at, word.size(), of_right));
    }
  }
  return names;
}

// Says why topics are what they are; those that were named are so for that.
void AddReasons(const RecordingTopics& said, const std::string& why_images,
                const std::string& why_imu, RecordingTopics* topics) {
  const auto add = [&](const std::string& name, bool is_said, const char* what,
                       const std::string& why) {
    if (name.empty()) return;
    topics->reasons.push_back(
        fmt::format("{} is {}: {}", name, what, is_said ? "named with --topics" : why));
  };
  const bool both = topics->gyro == topics->accel;
  add(topics->left, !said.left.empty(), topics->right.empty() ? "the camera" : "the left camera",
      why_images);
  add(topics->right, !said.right.empty(), "the right camera", why_images);
  for (const std::string& other : topics->others) {
    add(other, !said.others.empty(), "another camera", "its name differs by a number alone");
  }
  add(topics->gyro, !said.gyro.empty(), both ? "the IMU" : "the gyroscope", why_imu);
  if (!both) add(topics->accel, !said.accel.empty(), "the accelerometer", why_imu);
}

// Of several matches of the same images, the nearest.
void KeepNearest(std::vector<ProfileMatch>* matches) {
  std::map<std::string, const ProfileMatch*> nearest;
  for (const ProfileMatch& match : *matches) {
    const ProfileMatch*& best = nearest[match.topics.left];
    if (best == nullptr || match.letters > best->letters) best = &match;
  }
  std::vector<ProfileMatch> kept;
  for (const auto& [left, match] : nearest) kept.push_back(*match);
  *matches = kept;
}

using Looks = std::map<std::string, ImageLook>;

// A name without the last number in it, which tells a camera from others, and that; "" and 0 where
// it has none.
std::pair<std::string, int> TakeNumber(const std::string& name) {
  constexpr const char* kDigits = "0123456789";
  const size_t last = name.find_last_of(kDigits);
  if (last == std::string::npos) return {};
  const size_t first = name.find_last_not_of(kDigits, last) + 1;  // 0 where there is nothing before
  if (last - first > 2) return {};
  return {name.substr(0, first) + "#" + name.substr(last + 1),
          std::stoi(name.substr(first, last + 1 - first))};
}

Looks LookAtImages(const std::vector<std::string>& names, Bag* bag) {
  Looks looks;
  for (const auto& [name, message] : ReadFirstMessages(names, bag)) {
    if (const auto look = LookAtImage(message)) looks[name] = *look;
  }
  return looks;
}

bool IsDepth(const std::string& name, const Looks& looks) {
  const auto look = looks.find(name);
  const bool is_by_kind = look != looks.end() && (look->second.encoding.starts_with("16UC1") ||
                                                  look->second.encoding.starts_with("32FC1"));
  return is_by_kind || name.find("depth") != std::string::npos ||
         name.find("Depth") != std::string::npos;
}

// Images of two cameras that take them together are of one size and about as many.
bool MayBePair(const std::string& left, const std::string& right, const Looks& looks,
               const Bag& bag) {
  constexpr double kLeastShare = 0.8;
  const auto a = looks.find(left), b = looks.find(right);
  const bool known = a != looks.end() && b != looks.end();
  if (known && a->second.size_px != b->second.size_px) return false;
  const auto count_left = static_cast<double>(FindTopicNamed(bag, left)->messages);
  const auto count_right = static_cast<double>(FindTopicNamed(bag, right)->messages);
  if (count_left < 0 || count_right < 0) return true;
  return std::min(count_left, count_right) >= kLeastShare * std::max(count_left, count_right);
}

// Adds to a pair that is told by a number those cameras whose topics have another number instead.
void AddNumbered(const RecordingTopics& said, Bag* bag, RecordingTopics* topics) {
  topics->others = said.others;
  const std::string family = TakeNumber(topics->left).first;
  const bool is_asked_for = !said.left.empty() || !said.others.empty();
  if (is_asked_for || family.empty() || TakeNumber(topics->right).first != family) return;
  std::map<int, std::string> by_number;
  for (const std::string& name : FindNames(*bag, IsImageTopic)) {
    const auto& [others_family, number] = TakeNumber(name);
    const bool is_other = name != topics->left && name != topics->right;
    if (is_other && others_family == family) by_number[number] = name;
  }
  if (by_number.empty()) return;
  std::vector<std::string> names = {topics->left};
  for (const auto& [number, name] : by_number) names.push_back(name);
  const Looks looks = LookAtImages(names, bag);
  for (const auto& [number, name] : by_number) {
    if (MayBePair(topics->left, name, looks, *bag)) topics->others.push_back(name);
  }
}

std::optional<RecordingTopics> ChooseByProfile(Bag* bag, const RecordingTopics& said) {
  std::vector<ProfileMatch> matches = MatchProfiles(KnownProfiles(), said, bag);
  KeepNearest(&matches);
  if (matches.empty()) return std::nullopt;
  if (matches.size() > 1) {
    std::string rigs;
    for (const ProfileMatch& match : matches) {
      rigs += fmt::format("{}{} ({})", rigs.empty() ? "" : ", ", match.topics.left,
                          match.profile->name);
    }
    FailChoice(*bag, fmt::format("{} rigs that are known, by their left cameras {}", matches.size(),
                                 rigs));
  }
  const RigProfile& profile = *matches.front().profile;
  RecordingTopics topics = matches.front().topics;
  if (!said.left.empty()) topics.right = said.right;  // left= alone is one camera
  AddNumbered(said, bag, &topics);
  topics.profile = profile.name;
  const std::string why = fmt::format("profile {} ({})", profile.name, profile.rig);
  AddReasons(said, why, why, &topics);
  if (!profile.note.empty()) topics.reasons.push_back(profile.name + ": " + profile.note);
  return topics;
}

// Returns why.
std::string ChooseImages(Bag* bag, RecordingTopics* topics) {
  if (!topics->left.empty()) return "";
  std::vector<std::string> images = FindNames(*bag, IsImageTopic);
  const Looks looks = LookAtImages(images, bag);
  std::erase_if(images, [&](const std::string& name) { return IsDepth(name, looks); });
  std::set<std::pair<std::string, std::string>> pairs;
  for (const std::string& left : images) {
    for (const std::string& right : NamesOfRight(left)) {
      const bool is_there = std::ranges::count(images, right) > 0;
      if (is_there && MayBePair(left, right, looks, *bag)) pairs.emplace(left, right);
    }
  }
  std::set<std::string> families;
  for (const auto& [left, right] : pairs) families.insert(TakeNumber(left).first);
  const bool is_numbered = families.size() == 1 && !families.begin()->empty();
  if (pairs.size() == 1 || is_numbered) {
    std::tie(topics->left, topics->right) = *pairs.begin();
    return pairs.size() == 1 ? "the only two topics of images whose names differ so"
                             : "the first of topics of images that are numbered";
  }
  if (images.size() == 1) {
    topics->left = images.front();
    return "the only topic of images";
  }
  FailChoice(*bag, images.empty() ? "no topic of images"
                                  : fmt::format("{} topics of images, {} pairs of them",
                                                images.size(), pairs.size()));
}

std::string ChooseImu(const Bag& bag, bool needs_imu, RecordingTopics* topics) {
  if (!topics->gyro.empty() && !topics->accel.empty()) return "";
  const std::vector<std::string> found = FindNames(bag, IsImuTopic);
  std::vector<std::string> gyros, accels;
  for (const std::string& name : found) {
    if (name.find("gyro") != std::string::npos) gyros.push_back(name);
    if (name.find("accel") != std::string::npos) accels.push_back(name);
  }
  if (found.size() == 1) {
    topics->gyro = topics->accel = found.front();
    return "the only topic of an IMU";
  }
  if (gyros.size() != 1 || accels.size() != 1 || found.size() != 2) {
    if (!needs_imu) return "";
    if (found.empty()) {
      FailChoice(bag, "no topic of an IMU",
                 "record the IMU's topic (sensor_msgs Imu) with the images, or map with poses by "
                 "another program: slcmap map --poses");
    }
    FailChoice(bag, fmt::format("{} topics of an IMU", found.size()));
  }
  topics->gyro = gyros.front();
  topics->accel = accels.front();
  return "the only topics of a gyroscope and an accelerometer, by their names";
}

}  // namespace

RecordingTopics ChooseTopics(Bag* bag, const RecordingTopics& said, bool needs_imu) {
  RequireTopic(*bag, said.left, IsImageTopic, "images");
  RequireTopic(*bag, said.right, IsImageTopic, "images");
  for (const std::string& other : said.others) RequireTopic(*bag, other, IsImageTopic, "images");
  RequireTopic(*bag, said.gyro, IsImuTopic, "an IMU");
  RequireTopic(*bag, said.accel, IsImuTopic, "an IMU");
  if (const auto known = ChooseByProfile(bag, said)) return *known;
  RecordingTopics topics = said;
  const std::string why_images = ChooseImages(bag, &topics);
  AddNumbered(said, bag, &topics);
  const std::string why_imu = ChooseImu(*bag, needs_imu, &topics);
  AddReasons(said, why_images, why_imu, &topics);
  return topics;
}

RecordingTopics ParseTopics(const std::string& text) {
  RecordingTopics topics;
  std::vector<std::string> entries = SplitAtCommas(text);
  if (entries.back().empty()) entries.pop_back();
  for (const std::string& entry : entries) {
    const size_t equal = entry.find('=');
    const std::string role = entry.substr(0, equal);
    const std::string name = equal == std::string::npos ? "" : entry.substr(equal + 1);
    std::vector<std::string*> places;
    if (role == "left") places = {&topics.left};
    if (role == "right") places = {&topics.right};
    if (role == "other") places = {&topics.others.emplace_back()};
    if (role == "gyro" || role == "imu") places.push_back(&topics.gyro);
    if (role == "accel" || role == "imu") places.push_back(&topics.accel);
    if (name.empty() || places.empty()) {
      throw ConfigError(fmt::format(
          "--topics: found '{}', expected left=/a,right=/b,imu=/c, or gyro=/c,accel=/d", entry));
    }
    for (std::string* place : places) {
      if (!place->empty()) throw ConfigError("--topics: found " + role + "= twice, expected once");
      *place = name;
    }
  }
  if (!topics.left.empty() && topics.left == topics.right) {
    throw ConfigError("--topics: found left= and right= of one topic, expected two");
  }
  if (topics.left.empty() && !topics.right.empty()) {
    throw ConfigError("--topics: found right= without left=, expected both, or left= alone");
  }
  if (!topics.others.empty() && topics.right.empty()) {
    throw ConfigError("--topics: found other= without left= and right=, expected a pair first");
  }
  for (const std::string& other : topics.others) {
    if (other == topics.left || other == topics.right ||
        std::ranges::count(topics.others, other) > 1) {
      throw ConfigError("--topics: found " + other + " twice, expected a topic for each camera");
    }
  }
  if (topics.gyro.empty() != topics.accel.empty()) {
    throw ConfigError("--topics: found one of gyro= and accel=, expected both, or imu=");
  }
  return topics;
}

std::string TopicsText(const RecordingTopics& topics) {
  std::string text;
  const auto add = [&](const char* role, const std::string& name) {
    if (!name.empty()) text += fmt::format("{}{}={}", text.empty() ? "" : ",", role, name);
  };
  const bool both = topics.gyro == topics.accel;
  add("left", topics.left);
  add("right", topics.right);
  for (const std::string& other : topics.others) add("other", other);
  add(both ? "imu" : "gyro", topics.gyro);
  if (!both) add("accel", topics.accel);
  return text;
}

}  // namespace slcmap::data
