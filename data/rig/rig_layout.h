// How a rig's driver lays out its bag: topics, frames, and the messages that tell its calibration,
// as bag_calibration.h reads them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "data/bag/bag.h"
#include "data/bag/messages.h"
#include "data/calibration/camera_info.h"
#include "data/core/types.h"
#include "data/rig/profile.h"
#include "data/rig/topics.h"

namespace slcmap::inline data {

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
