#include "export/model_images.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <set>

#include "mapping/map_poses.h"

namespace slcmap {
namespace {

// Keyframes and the poses at which lines were seen, by stamp.
std::map<int64_t, RigidTransform> PosesOf(const MapResult& map) {
  std::set<int64_t> used_ns;
  for (const StampedPose& pose : map.keyframes) used_ns.insert(pose.stamp_ns);
  for (const LineSupport& support : map.line_evidence.supports) used_ns.insert(support.stamp_ns);
  std::map<int64_t, RigidTransform> poses;
  for (const auto& [stamp_ns, T_world_imu] : PosesByStamp(map)) {
    if (used_ns.contains(stamp_ns)) poses.emplace(stamp_ns, T_world_imu);
  }
  return poses;
}

// The recording's folder, or the one above mav0.
std::string GetRecording(const MergedRun& run) {
  std::filesystem::path path = run.sequence;
  if (!path.has_filename()) path = path.parent_path();  // ends in a slash
  return (path.filename() == "mav0" ? path.parent_path() : path).filename().string();
}

// Readers of COLMAP's text end names at blanks.
bool IsFolderName(const std::string& name) {
  const auto is_plain = [](unsigned char c) {
    return std::isalnum(c) || c == '_' || c == '-' || c == '.';
  };
  return !name.empty() && name[0] != '.' && std::ranges::all_of(name, is_plain);
}

// Names that tell the runs of a merged map apart: those of their recordings, else their ids, else
// numbers.
std::vector<std::string> FoldersOf(const std::vector<MergedRun>& runs) {
  std::vector<std::string> recordings, ids, numbers;
  for (const MergedRun& run : runs) {
    recordings.push_back(GetRecording(run));
    ids.push_back(run.run_id);
    numbers.push_back(fmt::format("run_{}", numbers.size()));
  }
  for (const std::vector<std::string>* names : {&recordings, &ids}) {
    const std::set<std::string> different(names->begin(), names->end());
    if (different.size() == runs.size() && std::ranges::all_of(different, IsFolderName)) {
      return *names;
    }
  }
  return numbers;
}

// Names of images as recordings have them: with the numbers of the cameras that were used of each.
class ImageNames {
 public:
  explicit ImageNames(const MapSource& source)
      : runs_(source.merged), folders_(FoldersOf(runs_)), cameras_(source.opened.cameras) {}

  std::string Of(int64_t stamp_ns, int camera) const {
    for (std::size_t i = 0; i < runs_.size(); ++i) {
      const auto& poses = runs_[i].poses_ns;
      if (!poses || stamp_ns < poses->from_ns || stamp_ns > poses->to_ns) continue;
      return folders_[i] + "/" +
             InRecording(stamp_ns - runs_[i].stamps_moved_ns, runs_[i].opened.cameras, camera);
    }
    return InRecording(stamp_ns, cameras_, camera);
  }

 private:
  // Maps of earlier versions do not tell which cameras were used: the first two.
  static std::string InRecording(int64_t stamp_ns, const std::vector<int>& used, int camera) {
    const bool is_told = camera < std::ssize(used);
    return fmt::format("cam{}/data/{}.png", is_told ? used[camera] : camera, stamp_ns);
  }

  const std::vector<MergedRun>& runs_;
  const std::vector<std::string> folders_;
  const std::vector<int>& cameras_;
};

}  // namespace

bool IsCalibrated(const Camera& camera) {
  return camera.fx_px > 0 && camera.fy_px > 0 && camera.width_px > 0 && camera.height_px > 0;
}

std::vector<ModelImage> ModelImages(const MapResult& map) {
  const Rig& rig = map.rectified_rig;
  const ImageNames names(map.source);
  std::vector<ModelImage> images;
  for (const auto& [stamp_ns, T_world_imu] : PosesOf(map)) {
    for (int i = 0; i < 2; ++i) {
      if (!IsCalibrated(rig.cameras[i])) continue;
      images.push_back({static_cast<int>(images.size()) + 1, stamp_ns, i,
                        (T_world_imu * rig.T_imu_camera[i]).Inverse(), names.Of(stamp_ns, i)});
    }
  }
  return images;
}

}  // namespace slcmap
