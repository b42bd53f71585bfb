#include "export/sfm/model.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>
#include <utility>

#include "data/core/error.h"
#include "data/io/file.h"
#include "data/source/recorded_source.h"
#include "mapping/map/map.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap::inline exporting {
namespace {

constexpr int64_t kSameStamp_ns = 1000000;  // poses may come from tables that round

// A recording that a map was made of.
struct RecordingOfMap {
  std::string path;
  SequenceOptions opened;
  int64_t stamps_moved_ns = 0;
  std::optional<StampSpan> poses_ns;
};

std::vector<RecordingOfMap> ListRecordings(const MapResult& map, const RecordingOptions& options) {
  if (map.source.merged.empty()) {
    return {{options.sequence.empty() ? map.source.sequence : options.sequence,
             map.source.opened,
             0,
             {}}};
  }
  if (!options.sequence.empty()) {
    throw ConfigError(
        "sequence: found a map that was merged of several recordings, expected one of a single "
        "recording: those of a merged map are read where map.json says they are");
  }
  std::vector<RecordingOfMap> recordings;
  for (const MergedRun& run : map.source.merged) {
    recordings.push_back({run.sequence, run.opened, run.stamps_moved_ns, run.poses_ns});
  }
  return recordings;
}

std::unique_ptr<SequenceSource> OpenRecordingAt(const RecordingOfMap& recording,
                                                const RecordingOptions& options) {
  std::error_code error;
  if (recording.path.empty() || !std::filesystem::exists(recording.path, error)) {
    throw DataError(fmt::format(
        "images: found no recording {}, expected the one that the map was made of (--sequence "
        "names where it moved to)",
        recording.path.empty() ? "named by the map" : recording.path));
  }
  return OpenAgain(recording.path, recording.opened, options.calibration);
}

}  // namespace

RecordedImages::RecordedImages(const MapResult& map, const RecordingOptions& options) {
  for (const RecordingOfMap& recording : ListRecordings(map, options)) {
    recordings_.push_back({recording.path, OpenRecordingAt(recording, options),
                           recording.stamps_moved_ns, recording.poses_ns});
  }
}

std::size_t RecordedImages::FindRecordingAt(int64_t stamp_ns) const {
  const auto found = std::ranges::find_if(recordings_, [&](const Recording& recording) {
    const std::optional<StampSpan>& span = recording.poses_ns;
    return !span || (stamp_ns >= span->from_ns && stamp_ns <= span->to_ns);
  });
  return static_cast<std::size_t>(found - recordings_.begin());
}

cv::Mat RecordedImages::Read(std::size_t recording, int64_t stamp_ns, int camera) const {
  const Recording& from = recordings_[recording];
  const std::vector<int64_t>& stamps_ns = from.source->info().pair_stamps_ns;
  const std::size_t at = ImageAt(stamps_ns, stamp_ns - from.stamps_moved_ns);
  return at == stamps_ns.size() ? cv::Mat() : from.source->ReadImage(at, camera).image;
}

void RecordedImages::Refuse(std::size_t recording, std::size_t count) const {
  throw DataError(fmt::format(
      "{}: found none of the {} images of the map that can be read, expected the recording that "
      "the map was made of",
      recordings_[recording].path, count));
}

cv::Mat RectifyingMap(const Rig& rectified, const Rig& raw, int camera) {
  const Camera& to = rectified.cameras[camera];
  const Eigen::Quaterniond R_raw_rectified =
      raw.T_imu_camera[camera].rotation.conjugate() * rectified.T_imu_camera[camera].rotation;
  cv::Mat map(to.height_px, to.width_px, CV_32FC2, cv::Scalar(-1, -1));
  for (int y = 0; y < map.rows; ++y) {
    for (int x = 0; x < map.cols; ++x) {
      const auto ray = to.Unproject({x, y});
      if (!ray) continue;
      const auto pixel_px = raw.cameras[camera].Project(R_raw_rectified * *ray);
      if (!pixel_px) continue;
      map.at<cv::Vec2f>(y, x) = {static_cast<float>(pixel_px->x()),
                                 static_cast<float>(pixel_px->y())};
    }
  }
  return map;
}

std::size_t ImageAt(const std::vector<int64_t>& stamps_ns, int64_t stamp_ns) {
  const auto at =
      std::lower_bound(stamps_ns.begin(), stamps_ns.end(), stamp_ns - kSameStamp_ns / 2);
  if (at == stamps_ns.end() || *at - stamp_ns > kSameStamp_ns / 2) return stamps_ns.size();
  return static_cast<std::size_t>(at - stamps_ns.begin());
}

namespace {

// Keyframes and the poses at which lines were seen, by stamp.
std::map<int64_t, RigidTransform> CollectPoses(const MapResult& map) {
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
std::vector<std::string> ListFolders(const std::vector<MergedRun>& runs) {
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
      : runs_(source.merged), folders_(ListFolders(runs_)), cameras_(source.opened.cameras) {}

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
  for (const auto& [stamp_ns, T_world_imu] : CollectPoses(map)) {
    for (int i = 0; i < std::ssize(rig.cameras); ++i) {
      if (!IsCalibrated(rig.cameras[i])) continue;
      images.push_back({static_cast<int>(images.size()) + 1, stamp_ns, i,
                        (T_world_imu * rig.T_imu_camera[i]).Inverse(), names.Of(stamp_ns, i)});
    }
  }
  return images;
}

namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix23d = Eigen::Matrix<double, 2, 3>;

constexpr double kMaxError_px = 4;  // as COLMAP's own filter has it
constexpr double kLoss_px = 1;      // beyond it a sight counts less (Huber)
constexpr double kLeastDepth_m = 0.05;
constexpr int kIterations = 10;
constexpr std::size_t kLeastImages = 2;

// Cameras of the model's images.
class ModelCameras {
 public:
  ModelCameras(const Rig& rig, const std::vector<ModelImage>& images) : rig_(rig), images_(images) {
    for (std::size_t i = 0; i < images.size(); ++i) {
      places_[{images[i].stamp_ns, images[i].camera}] = i;
    }
  }

  // The place of an image among the model's; its end where it is none of them.
  std::size_t FindPlace(int64_t stamp_ns, int camera) const {
    const auto found = places_.find({stamp_ns, camera});
    return found == places_.end() ? images_.size() : found->second;
  }
  std::size_t size() const { return images_.size(); }

  Vector3d InCamera(std::size_t image, const Vector3d& p_world) const {
    return images_[image].T_camera_world * p_world;
  }
  Vector2d ProjectToPixel(std::size_t image, const Vector3d& p_camera) const {
    return PixelFromPlane(rig_.cameras[images_[image].camera], Vector2d(p_camera.hnormalized()));
  }
  // Of the pixel by p_world.
  Matrix23d PixelByPoint(std::size_t image, const Vector3d& p_camera) const {
    const Camera& camera = rig_.cameras[images_[image].camera];
    const double z = p_camera.z();
    Matrix23d by_camera;
    by_camera << camera.fx_px / z, 0, -camera.fx_px * p_camera.x() / (z * z), 0, camera.fy_px / z,
        -camera.fy_px * p_camera.y() / (z * z);
    return by_camera * images_[image].T_camera_world.rotation.toRotationMatrix();
  }

  // How far a sight is from where the point is seen; far where that is behind the camera.
  double Error_px(const ModelObservation& sight, const Vector3d& p_world) const {
    const Vector3d p_camera = InCamera(sight.image, p_world);
    if (p_camera.z() < kLeastDepth_m) return 1e3;
    return (ProjectToPixel(sight.image, p_camera) - sight.px).norm();
  }

 private:
  const Rig& rig_;
  const std::vector<ModelImage>& images_;
  std::map<std::pair<int64_t, int>, std::size_t> places_;  // by stamp and camera
};

double HuberCost(double error_px) {
  return error_px <= kLoss_px ? 0.5 * error_px * error_px : kLoss_px * (error_px - 0.5 * kLoss_px);
}

double ComputeCost(const ModelCameras& cameras, const std::vector<ModelObservation>& track,
                   const Vector3d& p_world) {
  double cost = 0;
  for (const ModelObservation& sight : track) cost += HuberCost(cameras.Error_px(sight, p_world));
  return cost;
}

// A step of Gauss and Newton towards the least cost.
Vector3d StepFrom(const ModelCameras& cameras, const std::vector<ModelObservation>& track,
                  const Vector3d& p_world) {
  Matrix3d information = Matrix3d::Zero();
  Vector3d gradient = Vector3d::Zero();
  for (const ModelObservation& sight : track) {
    const Vector3d p_camera = cameras.InCamera(sight.image, p_world);
    if (p_camera.z() < kLeastDepth_m) continue;
    const Vector2d off_px = cameras.ProjectToPixel(sight.image, p_camera) - sight.px;
    const Matrix23d J = cameras.PixelByPoint(sight.image, p_camera);
    const double weight = kLoss_px / std::max(kLoss_px, off_px.norm());
    information += weight * J.transpose() * J;
    gradient += weight * J.transpose() * off_px;
  }
  information.diagonal() *= 1 + 1e-6;  // a point that nearly all directions fit stays where it is
  return -information.ldlt().solve(gradient);
}

// Where the sights of a track see a point best, from where it is about.
Vector3d ComputePoint(const ModelCameras& cameras, const std::vector<ModelObservation>& track,
                      Vector3d p_world) {
  double cost = ComputeCost(cameras, track, p_world);
  for (int i = 0; i < kIterations; ++i) {
    const Vector3d next = p_world + StepFrom(cameras, track, p_world);
    if (!next.allFinite()) break;
    const double next_cost = ComputeCost(cameras, track, next);
    if (!(next_cost < cost)) break;
    const bool is_done = cost - next_cost < 1e-9 * cost;
    p_world = next;
    cost = next_cost;
    if (is_done) break;
  }
  return p_world;
}

// The point of a track; without sights where too few agree.
ModelPoint FitTrack(const ModelCameras& cameras, std::vector<ModelObservation> track,
                    const Vector3d& p_world) {
  ModelPoint point;
  point.p_world = ComputePoint(cameras, track, p_world);
  const auto is_off = [&](const ModelObservation& sight) {
    return cameras.Error_px(sight, point.p_world) > kMaxError_px;
  };
  while (std::erase_if(track, is_off) > 0)
    point.p_world = ComputePoint(cameras, track, point.p_world);
  if (track.size() < kLeastImages) return point;
  double sum_px = 0;
  for (const ModelObservation& sight : track) sum_px += cameras.Error_px(sight, point.p_world);
  point.error_px = sum_px / static_cast<double>(track.size());
  point.track = std::move(track);
  return point;
}

}  // namespace

std::vector<ModelPoint> ModelPoints(const MapResult& map, const std::vector<ModelImage>& images) {
  const ModelCameras cameras(map.rectified_rig, images);
  std::vector<ModelPoint> points;
  auto seen = map.point_observations.begin();
  const auto end = map.point_observations.end();
  for (std::size_t i = 0; i < map.points.size(); ++i) {
    const std::size_t before = points.size();
    const auto is_seen = [&] { return seen != end && seen->point == static_cast<int64_t>(i); };
    while (is_seen()) {
      std::vector<ModelObservation> track;
      for (const int number = seen->track; is_seen() && seen->track == number; ++seen) {
        const std::size_t image = cameras.FindPlace(seen->stamp_ns, seen->camera);
        if (image < cameras.size()) track.push_back({image, seen->px});
      }
      ModelPoint point = FitTrack(cameras, std::move(track), map.points[i].p_world);
      if (!point.track.empty()) points.push_back(std::move(point));
    }
    if (points.size() == before) points.push_back({map.points[i].p_world, -1, {}});
  }
  return points;
}

namespace {

void WriteImage(const std::string& path, const cv::Mat& image) {
  std::vector<uint8_t> bytes;
  cv::imencode(".png", image, bytes);
  MakeFolder(std::filesystem::path(path).parent_path());
  WriteFile(path, std::string(bytes.begin(), bytes.end()));
}

// The images of one of the recordings; those that cannot be read are counted.
std::vector<std::string> WriteImagesFrom(const RecordedImages& recorded, std::size_t recording,
                                         const Rig& rectified,
                                         const std::vector<ModelImage>& images,
                                         const std::string& folder, const Progress& progress,
                                         std::size_t* missing) {
  std::vector<cv::Mat> maps(rectified.cameras.size());
  for (int i = 0; i < std::ssize(maps); ++i) {
    if (!IsCalibrated(rectified.cameras[i])) continue;
    maps[i] = RectifyingMap(rectified, recorded.rig(recording), i);
  }
  std::vector<std::string> paths;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const ModelImage& image = images[i];
    if (recorded.FindRecordingAt(image.stamp_ns) != recording) continue;
    progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(images.size()));
    const cv::Mat raw = recorded.Read(recording, image.stamp_ns, image.camera);
    if (raw.empty()) {
      ++*missing;
      continue;
    }
    cv::Mat rectified_image;
    cv::remap(raw, rectified_image, maps[image.camera], cv::noArray(), cv::INTER_CUBIC);
    paths.push_back(folder + "/" + image.name);
    WriteImage(paths.back(), rectified_image);
  }
  return paths;
}

}  // namespace

std::vector<std::string> WriteRectifiedImages(const std::string& folder, const MapResult& map,
                                              const std::vector<ModelImage>& images,
                                              const RecordingOptions& options,
                                              const Progress& progress) {
  const RecordedImages recorded(map, options);
  std::vector<std::string> paths;
  std::size_t missing = 0;
  for (std::size_t i = 0; i < recorded.size(); ++i) {
    const std::size_t missing_before = missing;
    const std::vector<std::string> written =
        WriteImagesFrom(recorded, i, map.rectified_rig, images, folder, progress, &missing);
    if (written.empty() && missing > missing_before) recorded.Refuse(i, missing - missing_before);
    paths.insert(paths.end(), written.begin(), written.end());
  }
  if (missing > 0) {
    spdlog::warn("colmap/images: {} of {} images cannot be read and are left out", missing,
                 images.size());
  }
  spdlog::info("wrote {} images into colmap/images", paths.size());
  return paths;
}

}  // namespace slcmap::exporting
