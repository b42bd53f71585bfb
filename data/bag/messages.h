// The ROS messages that a recording is made of, in both layouts: that of ROS 1, and CDR of ROS 2;
// and the pixels and files that messages of cameras hold.
#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "data/bag/bag.h"

namespace slcmap::inline data {

// How most messages begin; decodes the start of any of those.
struct RosStamped {
  static constexpr const char* kType = "std_msgs/Header";
  int64_t stamp_ns = 0;
  std::string frame_id;
};

// Numbers that a message holds many of, in the bytes that it was decoded from.
struct RosBytes {
  BagBytes bytes;        // fewer than `written` where only the message's head was there
  uint32_t written = 0;  // as the message says; not needed for writing
};

struct RosImage : RosStamped {
  static constexpr const char* kType = "sensor_msgs/Image";
  uint32_t height_px = 0, width_px = 0;
  std::string encoding;  // such as "mono8"
  bool is_bigendian = false;
  uint32_t step_bytes = 0;  // from row to row
  RosBytes data;
};

struct RosCompressedImage : RosStamped {
  static constexpr const char* kType = "sensor_msgs/CompressedImage";
  std::string format;
  RosBytes data;
};

// Matrices are row by row.
struct RosCameraInfo : RosStamped {
  static constexpr const char* kType = "sensor_msgs/CameraInfo";
  uint32_t height_px = 0, width_px = 0;
  std::string distortion_model;
  std::vector<double> d;
  std::array<double, 9> k{}, r{};
  std::array<double, 12> p{};
  uint32_t binning_x = 0, binning_y = 0;
  uint32_t roi_x_px = 0, roi_y_px = 0, roi_height_px = 0, roi_width_px = 0;
  bool roi_rectify = false;
};

struct RosImu : RosStamped {
  static constexpr const char* kType = "sensor_msgs/Imu";
  std::array<double, 4> orientation_xyzw{};
  std::array<double, 9> orientation_covariance{};
  std::array<double, 3> angular_velocity_rad_s{};
  std::array<double, 9> angular_velocity_covariance{};
  std::array<double, 3> linear_acceleration_m_s2{};
  std::array<double, 9> linear_acceleration_covariance{};
};

struct RosTransform {
  static constexpr const char* kType = "geometry_msgs/Transform";
  std::array<double, 3> translation_m{};
  std::array<double, 4> rotation_xyzw{0, 0, 0, 1};
};

// Takes points of the child's frame to frame_id's.
struct RosTransformStamped : RosStamped {
  static constexpr const char* kType = "geometry_msgs/TransformStamped";
  std::string child_frame_id;
  RosTransform transform;
};

// Of topics of the type "tf/tfMessage" as well.
struct RosTransforms {
  static constexpr const char* kType = "tf2_msgs/TFMessage";
  std::vector<RosTransformStamped> transforms;
};

// For these types only. Throws DataError, without a place, for bytes that are cut short and for
// layouts that ROS does not write.
template <typename Message>
Message DecodeMessage(BagEncoding encoding, BagBytes bytes);

// CDR in little endian.
template <typename Message>
std::vector<std::byte> EncodeMessage(BagEncoding encoding, const Message& message);

// A topic of a bag that is written.
inline BagTopic MakeTopic(const std::string& name, const std::string& type, BagEncoding encoding) {
  return {name, type, encoding, encoding == BagEncoding::kRos1 ? "ros1" : "cdr"};
}

// What a bag says of a type of these messages; empty of others.
struct RosDefinition {
  std::string text;  // with those of the types in it
  std::string md5;   // as ROS 1 tells versions of a type apart
};
RosDefinition DefinitionFor(const std::string& type, BagEncoding encoding);

// How many bytes of pixels an image has by its size; nothing for an encoding without grey or
// colour, such as H.264.
std::optional<size_t> PixelBytes(const RosImage& image);

// Eight bits of grey, or the sixteen that are there; nothing as above. Throws DataError where there
// are fewer pixels than the size says.
std::optional<cv::Mat> GreyFrom(const RosImage& image);

// What the name of a file that begins so ends with: ".png" or ".jpg"; "" of others.
std::string ExtensionFor(std::string_view bytes);

}  // namespace slcmap::data
