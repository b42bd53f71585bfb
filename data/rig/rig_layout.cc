#include "data/rig/rig_layout.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "data/calibration/camera_words.h"
#include "data/core/error.h"
#include "data/rig/frames.h"
#include "data/rig/peek.h"

namespace slcmap::inline data {
namespace {

std::string ParentTopic(const std::string& topic) { return topic.substr(0, topic.rfind('/')); }

RosTransform ToRos(const RigidTransform& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  const Eigen::Vector3d& t = pose.translation;
  return {{t.x(), t.y(), t.z()}, {q.x(), q.y(), q.z(), q.w()}};
}

RosTransforms FixedFrames(const RigLayout& layout) {
  const auto& [T_imu_left, T_imu_right] = layout.rig.T_imu_camera;
  const RigidTransform T_link_left(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5), {0, 0, 0});
  const std::string left = layout.FindFrame(layout.topics.left);
  const std::string gyro = layout.FindFrame(layout.topics.gyro);
  RosTransforms frames;
  const auto add = [&](const std::string& parent, const std::string& child,
                       const RigidTransform& pose) {
    RosTransformStamped& frame = frames.transforms.emplace_back();
    frame.frame_id = parent;
    frame.child_frame_id = child;
    frame.transform = ToRos(pose);
  };
  add("base_link", left, T_link_left);
  add("base_link", gyro, T_link_left * T_imu_left.Inverse());
  if (layout.topics.accel != layout.topics.gyro) {
    add(gyro, layout.FindFrame(layout.topics.accel), {});
  }
  if (!layout.topics.right.empty()) {
    add(left, layout.FindFrame(layout.topics.right), T_imu_left.Inverse() * T_imu_right);
  }
  return frames;
}

// They take points of the left camera to each stream.
std::vector<std::pair<std::string, RigidTransform>> ViewerPoses(const RigLayout& layout) {
  const auto& [T_imu_left, T_imu_right] = layout.rig.T_imu_camera;
  return {{layout.topics.left, {}},
          {layout.topics.right, T_imu_right.Inverse() * T_imu_left},
          {layout.topics.gyro, T_imu_left}};
}

std::vector<double> RosCoefficients(const CameraWords& words) {
  std::vector<double> d = words.coefficients;
  if (d.size() < 5 && words.distortion_model != "equidistant") d.resize(5);
  return d;
}

}  // namespace

bool RigLayout::IsColoured() const { return topics.left.find("color") != std::string::npos; }

std::string RigLayout::ImageTopic(int camera) const {
  if (camera > 1) return "";
  return camera == 0 ? topics.left : topics.right;
}

std::string RigLayout::InfoTopic(int camera) const {
  const std::string images = ImageTopic(camera);
  const std::string stream = ViewerStream(images);
  if (!stream.empty()) return stream + "/info/camera_info";
  const bool has_own = ParentTopic(topics.left) != ParentTopic(topics.right);
  return (has_own ? ParentTopic(images) : images) + "/camera_info";
}

std::string RigLayout::FindFrame(const std::string& topic) const {
  const bool is_camera = topic == topics.left || topic == topics.right;
  std::string name = is_camera ? ParentTopic(InfoTopic(topic == topics.left ? 0 : 1)) : topic;
  std::ranges::replace(name, '/', '_');
  return name.substr(1) + (is_camera ? "_optical_frame" : "_frame");
}

RosCameraInfo RigLayout::Info(int camera) const {
  const Camera& lens = rig.cameras[static_cast<size_t>(camera)];
  const CameraWords words = DescribeCamera(lens);
  if (words.camera_model != "pinhole") {
    throw ConfigError(
        fmt::format("camera_info: found the lens {}, expected a pinhole, with any "
                    "distortion: choose another --rig, or write a folder",
                    words.camera_model));
  }
  RosCameraInfo info;
  info.frame_id = FindFrame(ImageTopic(camera));
  info.width_px = static_cast<uint32_t>(lens.width_px);
  info.height_px = static_cast<uint32_t>(lens.height_px);
  info.d = RosCoefficients(words);
  const bool is_radial = words.distortion_model == "radtan" || words.distortion_model == "none";
  info.distortion_model = is_radial ? (info.d.size() > 5 ? "rational_polynomial" : "plumb_bob")
                                    : words.distortion_model;
  info.k = {lens.fx_px, 0, lens.cx_px, 0, lens.fy_px, lens.cy_px, 0, 0, 1};
  info.r = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  if (!ViewerStream(topics.left).empty()) return info;  // which leaves P empty
  const bool is_right = camera == 1 && kind == ImageKind::kRectified;
  const double baseline_m =
      is_right ? (rig.T_imu_camera[0].Inverse() * rig.T_imu_camera[1]).translation.x() : 0;
  info.p = {lens.fx_px, 0, lens.cx_px, -lens.fx_px * baseline_m, 0, lens.fy_px, lens.cy_px, 0, 0,
            0,          1, 0};
  return info;
}

RigLayout LayoutFor(const RigProfile& profile, const Rig& rig, size_t row) {
  const TopicPatterns& patterns = profile.topics.at(row);
  const auto fill = [&](const std::string& pattern) { return WithStar(pattern, profile.prefix); };
  RigLayout layout;
  layout.topics = {fill(patterns.left), fill(patterns.right), fill(patterns.gyro),
                   fill(patterns.accel), profile.name};
  layout.kind = KindByNames(&profile, layout.topics.left).value_or(ImageKind::kRaw);
  layout.rig = rig;
  return layout;
}

std::optional<ImageKind> KindByNames(const RigProfile* profile, const std::string& images) {
  if (profile != nullptr && profile->images) return profile->images;
  const bool is_rectified = images.find("rect") != std::string::npos;
  return is_rectified ? std::optional(ImageKind::kRectified) : std::nullopt;
}

Rig Rectified(const Rig& rig) {
  Rig rectified = rig;
  const auto& [T_imu_left, T_imu_right] = rig.T_imu_camera;
  const double baseline_m = (T_imu_left.Inverse() * T_imu_right).translation.norm();
  const Camera& left = rig.cameras[0];
  Camera camera;
  camera.width_px = left.width_px;
  camera.height_px = left.height_px;
  camera.fx_px = camera.fy_px = left.MiddleFocal_px();
  camera.cx_px = left.cx_px;
  camera.cy_px = left.cy_px;
  rectified.cameras.fill(camera);
  rectified.T_imu_camera[1] =
      T_imu_left * RigidTransform(Eigen::Quaterniond::Identity(), {baseline_m, 0, 0});
  return rectified;
}

std::vector<RigMessage> PoseMessages(const RigLayout& layout, BagEncoding encoding,
                                     int64_t stamp_ns) {
  std::vector<RigMessage> messages;
  if (!ViewerStream(layout.topics.left).empty()) {
    for (const auto& [topic, pose] : ViewerPoses(layout)) {
      messages.push_back({ViewerStream(topic) + "/tf/0", RosTransform::kType,
                          EncodeMessage(encoding, ToRos(pose))});
    }
    return messages;
  }
  RosTransforms frames = FixedFrames(layout);
  for (RosTransformStamped& frame : frames.transforms) frame.stamp_ns = stamp_ns;
  messages.push_back({"/tf_static", RosTransforms::kType, EncodeMessage(encoding, frames)});
  return messages;
}

}  // namespace slcmap::data
