#include "data/rig/bag_calibration.h"

#include <spdlog/fmt/fmt.h>

#include <array>
#include <cmath>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "data/bag/messages.h"
#include "data/calibration/camera_words.h"
#include "data/calibration/other_calibrations.h"
#include "data/calibration/rig_parts.h"
#include "data/rig/profile.h"
#include "data/rig/topics.h"

namespace slcmap::inline data {
namespace {

constexpr double kFixed_m = 1e-4, kFixed_rad = 1e-4;  // beyond, frames move
constexpr int kMostMoving = 5000;                     // messages of /tf

bool AreSame(const RigidTransform& a, const RigidTransform& b) {
  const RigidTransform difference = a.Inverse() * b;
  return difference.translation.norm() < kFixed_m &&
         LogRotation(difference.rotation).norm() < kFixed_rad;
}

void ReadFrames(bool are_fixed, int most, Bag* bag, FrameTree* frames) {
  std::vector<uint32_t> chosen;
  for (uint32_t i = 0; i < bag->topics().size(); ++i) {
    const BagTopic& topic = bag->topics()[i];
    const bool is_tf = topic.type == RosTransforms::kType || topic.type == "tf/tfMessage";
    if (is_tf && topic.name.ends_with("tf_static") == are_fixed) chosen.push_back(i);
  }
  if (chosen.empty()) return;
  int seen = 0;
  bag->Visit(chosen, 0, [&](const BagPlace& place, BagBytes bytes) {
    try {
      const BagEncoding encoding = bag->topics()[place.topic].encoding;
      for (const auto& transform : DecodeMessage<RosTransforms>(encoding, bytes).transforms) {
        frames->Add(transform, are_fixed);
      }
    } catch (const DataError&) {  // others may tell the same
    }
    return ++seen < most;
  });
}

}  // namespace

std::string PlainFrame(const std::string& frame_id) {
  return frame_id.starts_with('/') ? frame_id.substr(1) : frame_id;
}

std::optional<RigidTransform> FromRos(const RosTransform& transform) {
  constexpr double kMaxError = 1e-2;
  const auto& q = transform.rotation_xyzw;
  const auto& t = transform.translation_m;
  const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
  const Eigen::Vector3d translation(t[0], t[1], t[2]);
  if (!(std::abs(rotation.norm() - 1) < kMaxError) || !translation.allFinite()) return std::nullopt;
  return RigidTransform(rotation.normalized(), translation);
}

void FrameTree::Add(const RosTransformStamped& transform, bool is_fixed) {
  const auto T_parent_child = FromRos(transform.transform);
  if (!T_parent_child) return;
  const std::string parent = PlainFrame(transform.frame_id);
  const std::string child = PlainFrame(transform.child_frame_id);
  frames_.insert(parent);
  frames_.insert(child);
  const auto [edge, is_new] = edges_.try_emplace({parent, child}, Edge{*T_parent_child});
  if (is_new || is_fixed || AreSame(edge->second.T_parent_child, *T_parent_child)) return;
  edge->second.moves = true;
}

std::optional<RigidTransform> FrameTree::Find(const std::string& to,
                                              const std::string& from) const {
  const std::string goal = PlainFrame(from);
  std::map<std::string, RigidTransform> reached = {{PlainFrame(to), RigidTransform()}};
  std::deque<std::string> next = {PlainFrame(to)};
  while (!next.empty() && reached.count(goal) == 0) {
    const std::string frame = next.front();
    next.pop_front();
    const auto reach = [&](const std::string& other, const RigidTransform& T_frame_other) {
      if (reached.try_emplace(other, reached.at(frame) * T_frame_other).second) {
        next.push_back(other);
      }
    };
    for (const auto& [names, edge] : edges_) {
      if (edge.moves) continue;
      if (names.first == frame) reach(names.second, edge.T_parent_child);
      if (names.second == frame) reach(names.first, edge.T_parent_child.Inverse());
    }
  }
  const auto found = reached.find(goal);
  return found == reached.end() ? std::nullopt : std::optional(found->second);
}

Warnings FrameTree::warnings() const {
  Warnings warnings;
  std::map<std::string, std::string> parents;
  for (const auto& [names, edge] : edges_) {
    const auto [parent, is_new] = parents.try_emplace(names.second, names.first);
    if (is_new) continue;
    warnings.Add(kManyParents, names.second + " of " + parent->second + " and " + names.first);
  }
  return warnings;
}

namespace {

// Adds what is in /tf_static of all names; or in /tf, its first thousands of messages.
void ReadFixedFrames(Bag* bag, FrameTree* frames) {
  constexpr int kMostFixed = 100'000;
  ReadFrames(true, kMostFixed, bag, frames);
}

void ReadMovingFrames(Bag* bag, FrameTree* frames) { ReadFrames(false, kMostMoving, bag, frames); }

using FirstMessages = std::map<std::string, FirstMessage>;

// Where drivers put the camera_info of a topic of images; "" where there is none.
std::string FindInfoTopic(const Bag& bag, const std::string& images) {
  const std::string plain = WithoutCompressed(images);
  const std::string folder = plain.substr(0, plain.rfind('/'));
  std::vector<std::string> names = {folder + "/camera_info", plain + "/camera_info"};
  if (!ViewerStream(plain).empty()) names = {ViewerStream(plain) + "/info/camera_info"};
  for (const std::string& name : names) {
    const BagTopic* topic = FindTopicNamed(bag, name);
    if (topic != nullptr && topic->type == RosCameraInfo::kType) return name;
  }
  return "";
}

template <int kRows, int kCols, size_t kCount>
Eigen::Matrix<double, kRows, kCols> FromRowMajor(const std::array<double, kCount>& rows) {
  return Eigen::Map<const Eigen::Matrix<double, kRows, kCols, Eigen::RowMajor>>(rows.data());
}

// A camera of the bag: what its first messages say.
struct BagCamera {
  std::string images, info_topic;
  std::string frame;  // of its camera_info, else of its images
  std::optional<ImageLook> look;
  std::optional<CameraInfo> info;  // of images of this size
};

class BagRig {
 public:
  BagRig(const RecordingTopics& topics, const RigProfile* profile, Bag* bag, Warnings* warnings)
      : topics_(topics), bag_(bag), warnings_(warnings), profile_(profile) {
    parts_.has_right = !topics.right.empty();
  }

  RigParts Read() {
    cameras_.push_back({topics_.left, FindInfoTopic(*bag_, topics_.left), "", {}, {}});
    if (parts_.has_right) {
      cameras_.push_back({topics_.right, FindInfoTopic(*bag_, topics_.right), "", {}, {}});
    }
    for (const std::string& other : topics_.others) {
      cameras_.push_back({other, FindInfoTopic(*bag_, other), "", {}, {}});
    }
    ReadFirst();
    for (BagCamera& camera : cameras_) ReadCamera(&camera);
    TakeCameras();
    TakeViewerPoses();
    TakeFramePoses();
    return parts_;
  }

 private:
  void Found(const std::string& words) { parts_.found.push_back(words); }

  void ReadFirst() {
    std::vector<std::string> names = {topics_.gyro, topics_.accel};
    for (const BagCamera& camera : cameras_) {
      names.push_back(camera.images);
      names.push_back(camera.info_topic);
    }
    for (const std::string& topic : {topics_.left, topics_.right, topics_.gyro}) {
      const std::string stream = ViewerStream(topic);
      if (!stream.empty()) names.push_back(stream + "/tf/0");
    }
    first_ = ReadFirstMessages(names, bag_);
  }

  // camera_info is of the whole sensor, of which images are a part, in larger pixels (ROS REP 104,
  // sensor_msgs/CameraInfo).
  static void CutOut(RosCameraInfo* info) {
    const uint32_t bins_x = std::max(1u, info->binning_x), bins_y = std::max(1u, info->binning_y);
    if (info->roi_width_px > 0 && info->roi_height_px > 0) {
      info->width_px = info->roi_width_px, info->height_px = info->roi_height_px;
      info->k[2] -= info->roi_x_px, info->k[5] -= info->roi_y_px;
      info->p[2] -= info->roi_x_px, info->p[6] -= info->roi_y_px;
    }
    info->width_px /= bins_x, info->height_px /= bins_y;
    for (size_t i = 0; i < 3; ++i) info->k[i] /= bins_x, info->k[3 + i] /= bins_y;
    for (size_t i = 0; i < 4; ++i) info->p[i] /= bins_x, info->p[4 + i] /= bins_y;
  }

  void ReadCamera(BagCamera* camera) {
    const auto image = first_.find(camera->images);
    if (image != first_.end()) camera->look = LookAtImage(image->second);
    const auto stamped = DecodeFirst<RosStamped>(first_, camera->images);
    if (stamped) camera->frame = stamped->frame_id;
    auto message = DecodeFirst<RosCameraInfo>(first_, camera->info_topic);
    if (!message) {
      Found("no camera_info of " + camera->images);
      return;
    }
    if (!message->frame_id.empty()) camera->frame = message->frame_id;
    const auto find_size = [](const RosCameraInfo& info) {
      return cv::Size(static_cast<int>(info.width_px), static_cast<int>(info.height_px));
    };
    RosCameraInfo cut = *message;
    CutOut(&cut);
    if (camera->look && camera->look->size_px == find_size(cut)) message = cut;
    const cv::Size size_px = find_size(*message);
    if (camera->look && camera->look->size_px != size_px) {
      Found(fmt::format("{} of {} x {} pixels, while its images have {} x {}", camera->info_topic,
                        size_px.width, size_px.height, camera->look->size_px.width,
                        camera->look->size_px.height));
      return;
    }
    camera->info = {size_px.width,
                    size_px.height,
                    message->distortion_model,
                    message->d,
                    FromRowMajor<3, 3>(message->k),
                    FromRowMajor<3, 3>(message->r),
                    FromRowMajor<3, 4>(message->p),
                    bag_->path() + ": " + camera->info_topic};
  }

  ImageKind KindOfImages() const {
    if (const auto told = KindByNames(profile_, topics_.left)) return *told;
    bool undistorted = true;
    for (const BagCamera& camera : cameras_) {
      undistorted = undistorted && camera.info && IsUndistorted(*camera.info);
    }
    return undistorted ? ImageKind::kRectified : ImageKind::kRaw;
  }

  void TakeCameras() {
    const ImageKind kind = KindOfImages();
    const char* words = kind == ImageKind::kRectified ? "rectified" : "raw";
    parts_.Reserve(cameras_.size());
    for (size_t i = 0; i < cameras_.size(); ++i) {
      if (!cameras_[i].info) continue;
      parts_.cameras[i] = CameraFromInfo(*cameras_[i].info, kind);
      Found(fmt::format("{} of {} images", cameras_[i].info_topic, words));
    }
    if (cameras_.size() < 2 || !cameras_[0].info || !cameras_[1].info) return;
    parts_.T_left_right = RightPoseFromInfo(*cameras_[0].info, *cameras_[1].info, kind);
    if (!parts_.T_left_right) {
      Found("no baseline in their P and R");
    } else if (parts_.T_left_right->translation.x() < 0) {
      warnings_->Add(kCamerasSwapped, cameras_[1].info_topic);
      Found(fmt::format("{} at the left of {}", topics_.right, topics_.left));
    }
  }

  // Streams' transforms take points of a reference stream to them.
  std::optional<RigidTransform> ViewerPose(const std::string& topic) const {
    const auto message = DecodeFirst<RosTransform>(first_, ViewerStream(topic) + "/tf/0");
    return message ? FromRos(*message) : std::nullopt;
  }

  void TakeViewerPoses() {
    if (ViewerStream(topics_.left).empty()) return;
    const auto left = ViewerPose(topics_.left), right = ViewerPose(topics_.right);
    const auto imu = ViewerPose(topics_.gyro);
    if (left && right && !parts_.T_left_right) parts_.T_left_right = *left * right->Inverse();
    if (!left || !imu) return;
    parts_.T_imu_camera[0] = *imu * left->Inverse();
    Found("tf/0 of its streams");
  }

  // The frame of a camera whose axes are those of its images.
  std::string OpticalFrame(const FrameTree& frames, const std::string& frame) const {
    const std::string_view ending = "_frame";
    if (frame.find("optical") != std::string::npos || !frame.ends_with(ending)) return frame;
    const std::string optical =
        frame.substr(0, frame.size() - ending.size()) + "_optical" + std::string(ending);
    return frames.Has(optical) ? optical : frame;
  }

  std::string ImuFrame(const std::string& topic) const {
    const auto imu = DecodeFirst<RosStamped>(first_, topic);
    return imu ? imu->frame_id : "";
  }

  void TakeFramePoses() {
    if (parts_.T_imu_camera[0]) return;
    FrameTree frames;
    ReadFixedFrames(bag_, &frames);
    const std::string imu = ImuFrame(topics_.gyro);
    const std::string left = OpticalFrame(frames, cameras_[0].frame);
    auto pose = frames.Find(imu, left);
    if (!pose) {
      ReadMovingFrames(bag_, &frames);
      pose = frames.Find(imu, left);
    }
    if (imu.empty() || left.empty()) pose.reset();
    if (pose) {
      TakeImuPose(*pose, frames, imu, left);
    } else {
      Found(WhyNoPose(left, imu));
    }
    for (size_t i = 2; i < cameras_.size(); ++i) TakeOtherFrame(frames, imu, i);
    if (cameras_.size() > 1) TakeRightFrame(frames, left, OpticalFrame(frames, cameras_[1].frame));
    warnings_->Merge(frames.warnings());
  }

  std::string WhyNoPose(const std::string& left, const std::string& imu) const {
    if (topics_.gyro.empty()) return "no topic of an IMU";
    if (left.empty()) return "no frame_id in " + topics_.left;
    if (imu.empty()) return "no frame_id in " + topics_.gyro;
    return fmt::format("no tf from '{}' to '{}'", left, imu);
  }

  void TakeImuPose(const RigidTransform& pose, const FrameTree& frames, const std::string& imu,
                   const std::string& left) {
    parts_.T_imu_camera[0] = pose;
    Found(fmt::format("tf from {} to {}", left, imu));
    const bool is_zero = PlainFrame(imu) != PlainFrame(left) && pose.Matrix().isIdentity(1e-9);
    if (is_zero) warnings_->Add(kImuPoseIsZero, imu);
    const std::string accel = ImuFrame(topics_.accel);
    const auto T_gyro_accel = frames.Find(imu, accel);
    constexpr double kTurned_rad = 0.02;
    if (!T_gyro_accel || LogRotation(T_gyro_accel->rotation).norm() < kTurned_rad) return;
    throw InputFault(
        "calibration",
        fmt::format("{}: found {} turned against {} by tf, expected axes alike", bag_->path(),
                    accel, imu),
        "record the accelerometer and gyroscope as one topic, which has the axes of one frame");
  }

  void TakeOtherFrame(const FrameTree& frames, const std::string& imu, size_t camera) {
    const std::string frame = OpticalFrame(frames, cameras_[camera].frame);
    if (imu.empty() || frame.empty()) return;
    parts_.T_imu_camera[camera] = frames.Find(imu, frame);
    if (parts_.T_imu_camera[camera]) Found(fmt::format("tf from {} to {}", frame, imu));
  }

  // RealSense writes the left camera's frame for both.
  void TakeRightFrame(const FrameTree& frames, const std::string& left, const std::string& right) {
    constexpr double kSame_m = 0.01, kSame_rad = 0.03;
    if (left.empty() || right.empty() || PlainFrame(left) == PlainFrame(right)) return;
    const auto by_tf = frames.Find(left, right);
    if (!by_tf || by_tf->translation.norm() < 1e-3) return;
    if (!parts_.T_left_right) {
      parts_.T_left_right = *by_tf;
      Found(fmt::format("tf from {} to {}", right, left));
      return;
    }
    const RigidTransform apart = parts_.T_left_right->Inverse() * *by_tf;
    const bool is_turned = LogRotation(apart.rotation).norm() > kSame_rad;
    if (is_turned || apart.translation.norm() > kSame_m) warnings_->Add(kBaselinesDiffer, right);
  }

  const RecordingTopics& topics_;
  Bag* bag_;
  Warnings* warnings_;
  const RigProfile* profile_;  // nullptr of none
  std::vector<BagCamera> cameras_;
  FirstMessages first_;
  RigParts parts_;
};

RigParts ProfileParts(const RigProfile& profile) {
  RigParts parts;
  parts.camera_time_offset_s = profile.camera_time_offset_s;
  parts.imu_noise = profile.imu_noise;
  parts.found.push_back(fmt::format("profile {}{}", profile.name,
                                    profile.note.empty() ? "" : " (" + profile.note + ")"));
  return parts;
}

// The cameras whose calibration is known; of the first two that is asked for.
std::vector<int> KnownCameras(const RigParts& parts, const RecordingTopics& topics,
                              Warnings* warnings) {
  std::vector<int> known = parts.has_right ? std::vector{0, 1} : std::vector{0};
  for (size_t i = 2; i < parts.cameras.size(); ++i) {
    if (parts.cameras[i] && parts.T_imu_camera[i]) {
      known.push_back(static_cast<int>(i));
    } else {
      warnings->Add(kCamerasNotCalibrated, topics.Images().at(i));
    }
  }
  return known;
}

}  // namespace

Calibration ReadBagCalibration(const RecordingTopics& topics, const std::string& beside, Bag* bag,
                               Warnings* warnings, Mirrored mirrored,
                               const std::vector<int>& cameras) {
  if (!beside.empty() && !TellsParts(beside)) {
    return ReadCalibration(beside, warnings, mirrored, cameras);
  }
  RigParts parts;
  if (!beside.empty()) parts = ReadRigParts(SplitCalibrationPaths(beside), mirrored, warnings);
  parts.has_right = parts.has_right && !topics.right.empty();
  const auto profile = KnownProfiles().find(topics.profile);
  const bool is_known = profile != KnownProfiles().end();
  if (!IsWhole(parts)) {
    const RigProfile* known = is_known ? &profile->second : nullptr;
    AddParts(BagRig(topics, known, bag, warnings).Read(), &parts);
  }
  if (is_known) AddParts(ProfileParts(profile->second), &parts);
  const bool chooses = cameras.empty() && !topics.others.empty();
  return MakeCalibration(parts, bag->path(),
                         chooses ? KnownCameras(parts, topics, warnings) : cameras);
}

}  // namespace slcmap::data
