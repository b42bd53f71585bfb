// How a rig's driver lays out its bag: topics, frames, and the messages that tell its calibration,
// as bag_calibration.h reads them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "data/bag/bag.h"
#include "data/bag/messages.h"
#include "data/calibration/camera_info.h"
#include "data/core/types.h"
#include "data/rig/profile.h"
#include "data/rig/topics.h"

namespace slcmap::inline data {

struct RigLayout {
  RecordingTopics topics = {"/cam0/image_raw", "/cam1/image_raw", "/imu0", "/imu0"};  // EuRoC's
  ImageKind kind = ImageKind::kRaw;  // of its images
  Rig rig;                           // as the driver tells it

  bool IsColoured() const;                   // by the names of its topics
  std::string ImageTopic(int camera) const;  // "" of a camera that it has not
  std::string InfoTopic(int camera) const;   // the topic of its camera_info
  std::string FindFrame(const std::string& topic) const;

  // Of the pixels as they are written. Throws ConfigError for a lens that camera_info has no words
  // for.
  RosCameraInfo Info(int camera) const;
};

// As a profile has it in a row of its topics, with its prefix for *.
RigLayout LayoutFor(const RigProfile& profile, const Rig& rig, size_t row = 0);

// Whether images of these topics are rectified; nothing where names and profile (nullptr: none) do
// not tell.
std::optional<ImageKind> KindByNames(const RigProfile* profile, const std::string& images);

// The rig of images that are rectified, as drivers do it: the left camera stays where it is and as
// wide as it is, without its distortion, and the right one is the same at its right.
Rig Rectified(const Rig& rig);

// A message that stands once in a bag.
struct RigMessage {
  std::string topic, type;
  std::vector<std::byte> bytes;
};

// How cameras and IMU stand: tf_static, by way of a link whose x is ahead, or the transforms of
// RealSense Viewer's streams.
std::vector<RigMessage> PoseMessages(const RigLayout& layout, BagEncoding encoding,
                                     int64_t stamp_ns);

}  // namespace slcmap::data
