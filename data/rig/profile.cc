#include "data/rig/profile.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>

#include "data/calibration/calibration_keys.h"
#include "data/calibration/camera_words.h"
#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/yaml.h"
#include "data/rig/topics.h"

namespace slcmap::inline data {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void FailProfile(const YamlSection& section, const std::string& key,
                              const std::string& problem) {
  throw ConfigError(fmt::format("{}: {}: {}", section.place(), key, problem));
}

TopicPatterns ReadPatterns(YamlSection row) {
  TopicPatterns patterns;
  row.Read("left", &patterns.left);
  row.Read("right", &patterns.right);
  row.Read("gyro", &patterns.gyro);
  row.Read("accel", &patterns.accel);
  if (row.Has("imu")) {
    row.Read("imu", &patterns.gyro);
    patterns.accel = patterns.gyro;
  }
  row.Finish();
  for (const std::string* pattern : {&patterns.left, &patterns.gyro, &patterns.accel}) {
    if (!pattern->empty()) continue;
    FailProfile(row, "left", "found a row without left, or without imu or gyro and accel");
  }
  return patterns;
}

void ReadImages(YamlSection* root, RigProfile* profile) {
  std::string images;
  root->Read("images", &images);
  if (images == "rectified") profile->images = ImageKind::kRectified;
  if (images == "raw") profile->images = ImageKind::kRaw;
  if (!images.empty() && !profile->images) {
    FailProfile(*root, "images", fmt::format("found '{}', expected rectified or raw", images));
  }
  std::vector<std::vector<double>> resolutions;
  root->Read("resolutions", &resolutions);
  for (const auto& sides_px : resolutions) {
    if (sides_px.size() != 2) FailProfile(*root, "resolutions", "expected [width, height] of each");
    profile->resolutions_px.push_back(ResolutionFrom(sides_px, *root, "resolutions"));
  }
}

bool Exists(const std::string& name, bool (*is_of_type)(const BagTopic&), const Bag& bag) {
  const BagTopic* topic = FindTopicNamed(bag, name);
  return topic != nullptr && is_of_type(*topic);
}

// What * stands for where a name fits; nothing where it does not.
std::optional<std::string> FindStar(const std::string& pattern, const std::string& name) {
  const size_t star = pattern.find('*');
  if (star == std::string::npos) {
    return name == pattern ? std::optional<std::string>("") : std::nullopt;
  }
  const std::string before = pattern.substr(0, star), behind = pattern.substr(star + 1);
  const bool fits = name.size() >= before.size() + behind.size() && name.starts_with(before) &&
                    name.ends_with(behind);
  if (!fits) return std::nullopt;
  return name.substr(star, name.size() - before.size() - behind.size());
}

// As it is there, compressed or not; "" where it is not.
std::string FindImages(const std::string& name, const Bag& bag) {
  for (const std::string& there : {name, name + kCompressedSuffix}) {
    if (Exists(there, IsImageTopic, bag)) return there;
  }
  return "";
}

std::optional<RecordingTopics> FillPatterns(const TopicPatterns& patterns, const std::string& star,
                                            const Bag& bag) {
  RecordingTopics topics{.left = FindImages(WithStar(patterns.left, star), bag),
                         .right = {},
                         .gyro = WithStar(patterns.gyro, star),
                         .accel = WithStar(patterns.accel, star)};
  if (!patterns.right.empty()) topics.right = FindImages(WithStar(patterns.right, star), bag);
  const bool has_all = !topics.left.empty() && topics.right.empty() == patterns.right.empty() &&
                       Exists(topics.gyro, IsImuTopic, bag) &&
                       Exists(topics.accel, IsImuTopic, bag);
  return has_all ? std::optional(topics) : std::nullopt;
}

bool Agrees(const RecordingTopics& topics, const RecordingTopics& said) {
  const auto same = [](const std::string& of_said, const std::string& found) {
    return of_said.empty() || of_said == found;
  };
  return same(said.left, topics.left) && same(said.right, topics.right) &&
         same(said.gyro, topics.gyro) && same(said.accel, topics.accel);
}

size_t CountLetters(const TopicPatterns& patterns) {
  size_t letters = 0;
  for (const std::string* p : {&patterns.left, &patterns.right, &patterns.gyro, &patterns.accel}) {
    letters += p->size() - static_cast<size_t>(std::ranges::count(*p, '*'));
  }
  return letters;
}

// Of a profile, the first row of each text that * stands for.
void MatchRows(const RigProfile& profile, const RecordingTopics& said, const Bag& bag,
               std::vector<ProfileMatch>* matches) {
  std::vector<std::string> stars;
  for (const TopicPatterns& patterns : profile.topics) {
    for (const BagTopic& topic : bag.topics()) {
      if (!IsImageTopic(topic)) continue;
      const auto star = FindStar(patterns.left, WithoutCompressed(topic.name));
      if (!star || std::ranges::count(stars, *star) > 0) continue;
      const auto topics = FillPatterns(patterns, *star, bag);
      if (!topics || !Agrees(*topics, said)) continue;
      stars.push_back(*star);
      matches->push_back({&profile, *topics, CountLetters(patterns)});
    }
  }
}

// Where a profile has sizes of images, others are not its.
void CheckResolutions(Bag* bag, std::vector<ProfileMatch>* matches) {
  constexpr size_t kLetters = 100;  // a size says more than names do
  std::vector<std::string> names;
  for (const ProfileMatch& match : *matches) {
    if (!match.profile->resolutions_px.empty()) names.push_back(match.topics.left);
  }
  if (names.empty()) return;
  const auto first = ReadFirstMessages(names, bag);
  std::erase_if(*matches, [&](const ProfileMatch& match) {
    const auto& sizes = match.profile->resolutions_px;
    if (sizes.empty()) return false;
    const auto message = first.find(match.topics.left);
    const auto look = message == first.end() ? std::nullopt : LookAtImage(message->second);
    return !look || std::ranges::count(sizes, look->size_px) == 0;
  });
  for (ProfileMatch& match : *matches) {
    if (!match.profile->resolutions_px.empty()) match.letters += kLetters;
  }
}

std::map<std::string, RigProfile> ReadProfiles(const std::string& folder) {
  std::map<std::string, RigProfile> profiles;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() != ".yaml") continue;
    const RigProfile profile = ReadProfile(entry.path().string());
    profiles[profile.name] = profile;
  }
  return profiles;
}

}  // namespace

std::string WithStar(std::string pattern, const std::string& star) {
  const size_t at = pattern.find('*');
  return at == std::string::npos ? pattern : pattern.replace(at, 1, star);
}

RigProfile ReadProfile(const std::string& path) {
  RigProfile profile;
  profile.name = fs::path(path).stem().string();
  YamlSection root = YamlSection::FromFile(path);
  root.Read("rig", &profile.rig);
  for (const YamlSection& row : root.List("topics")) profile.topics.push_back(ReadPatterns(row));
  if (profile.topics.empty()) FailProfile(root, "topics", "missing, expected names of topics");
  root.Read("prefix", &profile.prefix);
  ReadImages(&root, &profile);
  if (root.Has("time_offset_s"))
    root.Read("time_offset_s", &profile.camera_time_offset_s.emplace());
  if (root.Has("imu_noise")) {
    YamlSection noise = root.Section("imu_noise");
    ReadNoise(noise, {}, &profile.imu_noise.emplace());
    noise.Finish();
  }
  root.Read("note", &profile.note);
  root.Finish();
  return profile;
}

const std::map<std::string, RigProfile>& KnownProfiles() {
  static const std::map<std::string, RigProfile> profiles =
      ReadProfiles(ConfigFolder() + "/profiles");
  return profiles;
}

std::vector<ProfileMatch> MatchProfiles(const std::map<std::string, RigProfile>& profiles,
                                        const RecordingTopics& said, Bag* bag) {
  std::vector<ProfileMatch> matches;
  for (const auto& [name, profile] : profiles) MatchRows(profile, said, *bag, &matches);
  CheckResolutions(bag, &matches);
  return matches;
}

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
