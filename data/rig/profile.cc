#include "data/rig/profile.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>

#include "data/calibration/calibration_keys.h"
#include "data/core/error.h"
#include "data/io/program_files.h"
#include "data/io/yaml.h"
#include "data/rig/peek.h"

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

}  // namespace slcmap::data
