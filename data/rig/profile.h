// What is known of a kind of rig, or of a data set, before its recording is read: which topics it
// is, and what its drivers do not say. A file a rig in config/profiles:
//
//   rig: RealSense D4xx, by ROS
//   topics:                 # the first that are all there; * is the same text in all of one row
//     - {left: "*/infra1/image_rect_raw", right: "*/infra2/image_rect_raw", imu: "*/imu"}
//     - {left: ..., right: ..., gyro: "*/gyro/sample", accel: "*/accel/sample"}
//   prefix: /zed/zed_node   # what * is in a bag that the simulator writes; /camera without it
//   images: rectified       # or raw; else by names and camera_info
//   resolutions: [[752, 480]]  # only images of these sizes
//   time_offset_s: 0.0056   # stamp on the IMU's clock = camera stamp + this
//   imu_noise: {...}        # Kalibr's keys
//   note: what to look out for
//
// Only rig and topics have to be there. Images may be compressed ("/compressed" behind the name).
//
// And how a rig's driver lays out its bag: topics, frames, and the messages that tell its
// calibration, as bag_calibration.h reads them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <opencv2/core/types.hpp>
#include <optional>
#include <string>
#include <vector>

#include "data/bag/bag.h"
#include "data/bag/messages.h"
#include "data/calibration/camera_words.h"
#include "data/core/types.h"
#include "data/rig/topics.h"

namespace slcmap::inline data {

struct TopicPatterns {
  std::string left, right, gyro, accel;  // right is "" of one camera
};

struct RigProfile {
  std::string name;  // of its file
  std::string rig;   // in words
  std::vector<TopicPatterns> topics;
  std::string prefix = "/camera";
  std::optional<ImageKind> images;
  std::vector<cv::Size> resolutions_px;  // empty: any
  std::optional<double> camera_time_offset_s;
  std::optional<ImuNoise> imu_noise;
  std::string note;
};

// Throws ConfigError, which names file and key.
RigProfile ReadProfile(const std::string& path);

// Those of config/profiles, by name; the same each time.
const std::map<std::string, RigProfile>& KnownProfiles();

// The name of a topic by its pattern.
std::string WithStar(std::string pattern, const std::string& star);

// The topics of a profile in a bag, of those that agree with `said`.
struct ProfileMatch {
  const RigProfile* profile = nullptr;
  RecordingTopics topics;
  size_t letters = 0;  // of names that the profile gives: with more it is nearer to the recording
};
std::vector<ProfileMatch> MatchProfiles(const std::map<std::string, RigProfile>& profiles,
                                        const RecordingTopics& said, Bag* bag);

struct RigLayout {
  Rig rig;  // as it is told
  RecordingTopics topics = {"/cam0/image_raw", "/cam1/image_raw", "/imu0", "/imu0"};  // EuRoC's
  ImageKind kind = ImageKind::kRaw;

  std::string ImagesTopic(int camera) const;  // "" of a camera that it has not
  std::string InfoTopic(int camera) const;    // the topic of its camera_info
  std::string FrameName(const std::string& topic) const;
  // Throws ConfigError for a lens that camera_info has no words for.
  RosCameraInfo Info(int camera) const;
};

// As a profile has it in a row of its topics, with its prefix for *.
RigLayout LayoutFor(const RigProfile& profile, const Rig& rig, size_t row = 0);

// What images of a topic are; nothing where neither its name nor a profile (nullptr: none) tells.
std::optional<ImageKind> KindByNames(const RigProfile* profile, const std::string& images);

// The rig of rectified images: the left camera as it stands, without distortion, and its twin.
Rig Rectified(const Rig& rig);

// Writes how cameras and IMU stand: tf_static, by way of a link whose x is ahead, or the transforms
// of RealSense Viewer's streams.
void WritePoses(const RigLayout& layout, BagEncoding encoding, int64_t stamp_ns, BagWriter* writer);

}  // namespace slcmap::data
