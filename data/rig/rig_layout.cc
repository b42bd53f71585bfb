#include "data/rig/rig_layout.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "data/calibration/camera_words.h"
#include "data/core/error.h"
#include "data/rig/peek.h"

namespace slcmap::inline data {
namespace {

std::string FolderName(const std::string& topic) { return topic.substr(0, topic.rfind('/')); }

RosTransform ToRos(const RigidTransform& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  const Eigen::Vector3d& t = pose.translation;
  return {{t.x(), t.y(), t.z()}, {q.x(), q.y(), q.z(), q.w()}};
}

RosTransforms FixedFrames(const RigLayout& layout, int64_t stamp_ns) {
  const RecordingTopics& topics = layout.topics;
  const RigidTransform &T_imu_left = layout.rig.T_imu_camera[0],
                       &T_imu_right = layout.rig.T_imu_camera[1];
  const RigidTransform T_link_left(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5), {0, 0, 0});
  const std::string left = layout.FrameName(topics.left), gyro = layout.FrameName(topics.gyro);
  RosTransforms frames;
  const auto add = [&](const std::string& parent, const std::string& child,
                       const RigidTransform& pose) {
    frames.transforms.push_back({{stamp_ns, parent}, child, ToRos(pose)});
  };
  add("base_link", left, T_link_left);
  add("base_link", gyro, T_link_left * T_imu_left.Inverse());
  if (topics.accel != topics.gyro) add(gyro, layout.FrameName(topics.accel), {});
  if (topics.right.empty()) return frames;
  add(left, layout.FrameName(topics.right), T_imu_left.Inverse() * T_imu_right);
  return frames;
}

}  // namespace

std::string RigLayout::ImagesTopic(int camera) const {
  return camera == 0 ? topics.left : camera == 1 ? topics.right : "";
}

std::string RigLayout::InfoTopic(int camera) const {
  const std::string images = ImagesTopic(camera), stream = ViewerStream(images);
  if (!stream.empty()) return stream + "/info/camera_info";
  const bool has_own = FolderName(topics.left) != FolderName(topics.right);
  return (has_own ? FolderName(images) : images) + "/camera_info";
}

std::string RigLayout::FrameName(const std::string& topic) const {
  const bool is_left = topic == topics.left, is_camera = is_left || topic == topics.right;
  std::string name = is_camera ? FolderName(InfoTopic(is_left ? 0 : 1)) : topic;
  std::ranges::replace(name, '/', '_');
  return name.substr(1) + (is_camera ? "_optical_frame" : "_frame");
}

RosCameraInfo RigLayout::Info(int camera) const {
  const Camera& lens = rig.cameras[static_cast<size_t>(camera)];
  const CameraWords words = DescribeCamera(lens);
  if (words.camera_model != "pinhole") {
    throw ConfigError(
        fmt::format("camera_info: found the lens {}, expected a pinhole, with any distortion: "
                    "choose another --rig, or write a folder",
                    words.camera_model));
  }
  RosCameraInfo info;
  info.frame_id = FrameName(ImagesTopic(camera));
  info.width_px = static_cast<uint32_t>(lens.width_px);
  info.height_px = static_cast<uint32_t>(lens.height_px);
  info.distortion_model = words.distortion_model;
  info.d = words.coefficients;
  if (lens.distortion == Distortion::kNone || lens.distortion == Distortion::kRadialTangential) {
    info.d.resize(std::max<size_t>(5, info.d.size()));
    info.distortion_model = info.d.size() > 5 ? "rational_polynomial" : "plumb_bob";
  }
  const double fx = lens.fx_px, fy = lens.fy_px, cx = lens.cx_px, cy = lens.cy_px;
  info.k = {fx, 0, cx, 0, fy, cy, 0, 0, 1};
  info.r = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  if (!ViewerStream(topics.left).empty()) return info;  // which leaves P empty
  const bool tells_baseline = camera == 1 && kind == ImageKind::kRectified;
  const RigidTransform T_left_right = rig.T_imu_camera[0].Inverse() * rig.T_imu_camera[1];
  const double shift = tells_baseline ? -fx * T_left_right.translation.x() : 0;
  info.p = {fx, 0, cx, shift, 0, fy, cy, 0, 0, 0, 1, 0};
  return info;
}

RigLayout LayoutFor(const RigProfile& profile, const Rig& rig, size_t row) {
  const TopicPatterns& patterns = profile.topics.at(row);
  const auto fill = [&](const std::string& pattern) { return WithStar(pattern, profile.prefix); };
  RigLayout layout{rig,
                   {fill(patterns.left), fill(patterns.right), fill(patterns.gyro),
                    fill(patterns.accel), profile.name}};
  layout.kind = KindByNames(&profile, layout.topics.left).value_or(ImageKind::kRaw);
  return layout;
}

std::optional<ImageKind> KindByNames(const RigProfile* profile, const std::string& images) {
  if (profile != nullptr && profile->images) return profile->images;
  const bool is_rectified = images.find("rect") != std::string::npos;
  return is_rectified ? std::optional(ImageKind::kRectified) : std::nullopt;
}

Rig Rectified(const Rig& rig) {
  Rig rectified = rig;
  const RigidTransform T_left_right = rig.T_imu_camera[0].Inverse() * rig.T_imu_camera[1];
  Camera& camera = rectified.cameras[0];
  camera.fx_px = camera.fy_px = camera.MiddleFocal_px();
  camera.distortion = Distortion::kNone;
  camera.coefficients.setZero();
  camera.higher_coefficients.setZero();
  camera.shape.setZero();
  rectified.cameras[1] = camera;
  rectified.T_imu_camera[1] =
      rig.T_imu_camera[0] *
      RigidTransform(Eigen::Quaterniond::Identity(), {T_left_right.translation.norm(), 0, 0});
  return rectified;
}

void WritePoses(const RigLayout& layout, BagEncoding encoding, int64_t stamp_ns,
                BagWriter* writer) {
  const auto write = [&](const std::string& topic, const auto& message) {
    const BagTopic made = MakeTopic(topic, std::decay_t<decltype(message)>::kType, encoding);
    writer->Write(writer->AddTopic(made), stamp_ns, EncodeMessage(encoding, message));
  };
  const RecordingTopics& topics = layout.topics;
  if (ViewerStream(topics.left).empty()) {
    write("/tf_static", FixedFrames(layout, stamp_ns));
    return;
  }
  // They take points of the left camera to each stream.
  const RigidTransform &T_imu_left = layout.rig.T_imu_camera[0],
                       &T_imu_right = layout.rig.T_imu_camera[1];
  write(ViewerStream(topics.left) + "/tf/0", ToRos({}));
  write(ViewerStream(topics.right) + "/tf/0", ToRos(T_imu_right.Inverse() * T_imu_left));
  write(ViewerStream(topics.gyro) + "/tf/0", ToRos(T_imu_left));
}

}  // namespace slcmap::data
