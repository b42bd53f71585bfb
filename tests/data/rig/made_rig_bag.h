// Bags of a few messages, as the drivers of rigs write them.
#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <utility>
#include <vector>

#include "data/bag/bag.h"
#include "data/bag/messages.h"
#include "data/core/rigid_transform.h"
#include "tests/testing/temp_folder.h"

namespace slcmap::testing {

inline constexpr int64_t kRigStamp_ns = 1'700'000'000'000'000'000;

inline RosTransform ToRos(const RigidTransform& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  const Eigen::Vector3d& t = pose.translation;
  return {{t.x(), t.y(), t.z()}, {q.x(), q.y(), q.z(), q.w()}};
}

class MadeRigBag {
 public:
  // "bag" (ROS 1) or "mcap" (CDR).
  explicit MadeRigBag(const std::string& form = "mcap")
      : form_(form), encoding_(form == "bag" ? BagEncoding::kRos1 : BagEncoding::kCdr) {}

  template <typename Message>
  void Add(const std::string& topic, Message message) {
    if constexpr (requires { message.stamp_ns; }) message.stamp_ns = kRigStamp_ns;
    messages_.push_back({{topic, Message::kType, encoding_, form_ == "bag" ? "ros1" : "cdr"},
                         EncodeMessage(encoding_, message)});
  }

  void AddImage(const std::string& topic, const cv::Size& size, const std::string& frame = "",
                const std::string& encoding = "mono8") {
    const cv::Mat pixels(size, CV_8U, cv::Scalar(90));
    if (topic.ends_with("/compressed")) {
      std::vector<uchar> file;
      cv::imencode(".png", pixels, file);
      RosCompressedImage image;
      image.frame_id = frame;
      image.format = "png";
      image.data.bytes = std::as_bytes(std::span(file));
      Add(topic, image);
      return;
    }
    RosImage image;
    image.frame_id = frame;
    image.width_px = image.step_bytes = static_cast<uint32_t>(size.width);
    image.height_px = static_cast<uint32_t>(size.height);
    image.encoding = encoding;
    image.data.bytes = std::as_bytes(std::span(pixels.data, pixels.total()));
    Add(topic, image);
  }

  void AddImu(const std::string& topic, const std::string& frame = "") {
    RosImu imu;
    imu.frame_id = frame;
    imu.linear_acceleration_m_s2 = {0, 0, 9.81};
    Add(topic, imu);
  }

  // T_parent_child of each.
  void AddFrames(const std::string& topic,
                 const std::vector<std::tuple<std::string, std::string, RigidTransform>>& frames) {
    RosTransforms message;
    for (const auto& [parent, child, pose] : frames) {
      RosTransformStamped& transform = message.transforms.emplace_back();
      transform.frame_id = parent;
      transform.child_frame_id = child;
      transform.transform = ToRos(pose);
    }
    Add(topic, message);
  }

  std::unique_ptr<Bag> Open() const {
    const std::string path = folder_.Path("walk." + form_);
    const auto writer = CreateBag(path, {form_, "none"});
    for (const auto& [topic, bytes] : messages_) {
      writer->Write(writer->AddTopic(topic), kRigStamp_ns, bytes);
    }
    writer->Close();
    return OpenBag(path);
  }

  const TempFolder& folder() const { return folder_; }

 private:
  std::string form_;
  BagEncoding encoding_;
  TempFolder folder_;
  std::vector<std::pair<BagTopic, std::vector<std::byte>>> messages_;
};

}  // namespace slcmap::testing
