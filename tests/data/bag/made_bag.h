// A short recording of two cameras and an IMU, written as any kind of bag, and what is read of one.
#pragma once

#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "data/bag/bag.h"
#include "data/bag/bytes.h"
#include "data/bag/messages.h"
#include "data/io/file.h"
#include "tests/testing/temp_folder.h"

namespace slcmap::testing {

struct BagCase {
  const char* form;
  const char* compression;
  BagEncoding encoding;
};

inline constexpr BagCase kBagCases[] = {
    {"bag", "none", BagEncoding::kRos1},  {"bag", "lz4", BagEncoding::kRos1},
    {"bag", "bz2", BagEncoding::kRos1},   {"db3", "none", BagEncoding::kCdr},
    {"db3", "zstd", BagEncoding::kCdr},   {"db3", "zstd_file", BagEncoding::kCdr},
    {"mcap", "none", BagEncoding::kCdr},  {"mcap", "lz4", BagEncoding::kCdr},
    {"mcap", "zstd", BagEncoding::kRos1}, {"mcap", "unchunked", BagEncoding::kCdr}};

struct BagMessage {
  std::string topic;
  int64_t received_ns = 0;
  std::vector<std::byte> bytes;
  bool operator==(const BagMessage&) const = default;
};

inline std::vector<BagTopic> MadeTopics(BagEncoding encoding) {
  std::vector<BagTopic> topics;
  for (const auto& [name, type] : {std::pair{"/cam0/image_raw", RosImage::kType},
                                   {"/cam1/image_raw", RosImage::kType},
                                   {"/cam0/camera_info", RosCameraInfo::kType},
                                   {"/imu0", RosImu::kType},
                                   {"/tf_static", RosTransforms::kType}}) {
    topics.push_back({name, type, encoding, encoding == BagEncoding::kCdr ? "cdr" : "ros1"});
  }
  return topics;
}

// `size_px` of square images.
inline std::vector<BagMessage> MadeMessages(BagEncoding encoding, int pairs, uint32_t size_px) {
  std::vector<BagMessage> messages;
  std::mt19937 random(7);
  std::vector<std::byte> pixels(size_px * size_px);
  const auto add = [&](const char* topic, auto message, int64_t stamp_ns) {
    if constexpr (requires { message.stamp_ns; }) message.stamp_ns = stamp_ns;
    messages.push_back({topic, stamp_ns + 3'000'000, EncodeMessage(encoding, message)});
  };
  const int64_t start_ns = 1'700'000'000'123'456'789;
  RosTransforms transforms;
  transforms.transforms.resize(1);
  transforms.transforms[0].child_frame_id = "imu";
  transforms.transforms[0].frame_id = "cam0";
  transforms.transforms[0].transform = {{0.1, -0.2, 0.3}, {0, 0.6, 0, 0.8}};
  add("/tf_static", transforms, start_ns);
  for (int i = 0; i < pairs; ++i) {
    const int64_t stamp_ns = start_ns + 50'000'000 * i;
    for (int k = 0; k < 10; ++k) {
      RosImu imu;
      imu.frame_id = "imu";
      imu.linear_acceleration_m_s2 = {0.1 * i, 0.01 * k, 9.81};
      add("/imu0", imu, stamp_ns + 5'000'000 * k);
    }
    RosImage image;
    image.frame_id = "cam0";
    image.height_px = image.width_px = image.step_bytes = size_px;
    image.encoding = "mono8";
    image.data.bytes = pixels;
    for (const char* topic : {"/cam0/image_raw", "/cam1/image_raw"}) {
      for (size_t p = 0; p < pixels.size(); ++p) {
        pixels[p] = static_cast<std::byte>(p / 8 + random() % 4);
      }
      add(topic, image, stamp_ns);
    }
    RosCameraInfo info;
    info.height_px = info.width_px = size_px;
    info.distortion_model = "plumb_bob";
    info.d = {0.1, 0.2, 0, 0, 0};
    info.k = {300, 0, 31.5, 0, 300, 31.5, 0, 0, 1};
    add("/cam0/camera_info", info, stamp_ns);
  }
  return messages;
}

inline void WriteBag(BagWriter* writer, const std::vector<BagTopic>& topics,
                     const std::vector<BagMessage>& messages) {
  for (const BagTopic& topic : topics) writer->AddTopic(topic);
  for (const BagMessage& message : messages) {
    for (uint32_t t = 0; t < topics.size(); ++t) {
      if (topics[t].name == message.topic) writer->Write(t, message.received_ns, message.bytes);
    }
  }
  writer->Close();
}

// As a recorder packs a file once it is whole.
inline void PackWhole(const std::string& file) {
  WriteFile(file + ".zstd", Pack("zstd", ReadFile(file)));
  std::filesystem::remove(file);
}

// Returns its path: a folder of a db3.
inline std::string MakeBag(const TempFolder& folder, const BagCase& how,
                           const std::vector<BagMessage>& messages) {
  const std::string path =
      folder.Path(std::string("walk") + (how.form == std::string("db3") ? "" : ".") +
                  (how.form == std::string("db3") ? "" : how.form));
  const bool is_whole = how.compression == std::string("zstd_file");
  WriteBag(CreateBag(path, {how.form, is_whole ? "none" : how.compression}).get(),
           MadeTopics(how.encoding), messages);
  if (is_whole) PackWhole(path + "/walk_0.db3");
  return path;
}

// The file that holds the messages.
inline std::string BagFile(const std::string& path, const BagCase& how) {
  if (how.form != std::string("db3")) return path;
  return path + "/walk_0.db3" + (how.compression == std::string("zstd_file") ? ".zstd" : "");
}

inline std::vector<uint32_t> AllTopics(const Bag& bag) {
  std::vector<uint32_t> all(bag.topics().size());
  for (uint32_t t = 0; t < all.size(); ++t) all[t] = t;
  return all;
}

inline std::vector<BagMessage> ReadMessages(Bag* bag) {
  std::vector<BagMessage> messages;
  bag->Visit(AllTopics(*bag), 0, [&](const BagPlace& place, BagBytes bytes) {
    messages.push_back({bag->topics()[place.topic].name, place.received_ns,
                        std::vector(bytes.begin(), bytes.end())});
    return true;
  });
  return messages;
}

}  // namespace slcmap::testing
