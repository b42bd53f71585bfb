#include "mapping/views/recorded_views.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "data/core/math.h"
#include "data/io/file.h"
#include "data/io/image.h"
#include "data/io/json.h"
#include "data/source/sequence.h"
#include "mapping/map/refinement.h"
#include "mapping/views/view_matches.h"
#include "mapping/views/views_between.h"
#include "odometry/frontend/rectifier.h"
#include "odometry/run/run.h"
#include "odometry/run/run_queries.h"

namespace slcmap::inline mapping {
namespace {

namespace fs = std::filesystem;

// Where the images of a view are; "" where there is none, as of a right camera that a knock has
// turned.
struct ViewFiles {
  std::string left_path, right_path;
  int left_camera = 0;
};

// Where the images of a run are.
struct RunImages {
  std::string place;  // folder or bag
  SharedImageStore store;
};

class RecordedImageReader : public ViewImages {
 public:
  RecordedImageReader(const Rig& raw_rig, const RectifierOptions& options,
                      const std::vector<PixelForm>& forms, SharedImageStore store,
                      std::vector<ViewFiles> files, SharedImageCache cache,
                      std::shared_ptr<LostImages> lost)
      : raw_rig_(raw_rig),
        rectifier_(raw_rig, options),
        forms_(forms),
        store_(std::move(store)),
        files_(std::move(files)),
        cache_(std::move(cache)),
        lost_(std::move(lost)) {}

  const Rig& rig() const override { return rectifier_.rectified_rig(); }
  const cv::Mat& mask(int camera) const override { return rectifier_.mask(camera); }
  int left_camera(size_t view) const override { return files_[view].left_camera; }

  StereoImage Read(size_t view) const override {
    StereoImage pair;
    const auto& [left_path, right_path, left_camera] = files_[view];
    pair.left = ReadRectified(left_path, left_camera);
    const bool is_left_alone = right_path.empty() && !left_path.empty();
    if (!is_left_alone) pair.right = ReadRectified(right_path, left_camera + 1);
    return pair;
  }

 private:
  cv::Mat ReadRectified(const std::string& path, int camera) const {
    const Camera& raw = raw_rig_.cameras[camera];
    const cv::Size size(raw.width_px, raw.height_px);
    const cv::Mat image =
        path.empty() ? cv::Mat() : cache_->Read(*store_, path, size, forms_[camera]);
    if (!image.empty()) return rectifier_.Rectify(image, camera);
    lost_->Add(path.empty() ? "an image that the run does not name" : path);
    return {};
  }

  const Rig raw_rig_;
  const Rectifier rectifier_;
  const std::vector<PixelForm> forms_;
  const SharedImageStore store_;
  const std::vector<ViewFiles> files_;
  const SharedImageCache cache_;
  const std::shared_ptr<LostImages> lost_;
};

void RequireStereo(const std::string& place, const Rig& rig) {
  if (IsStereo(rig)) return;
  throw DataError(fmt::format(
      "{}: found {}, expected two that see the same: mapping from images needs a stereo rig "
      "(--sparse maps from a run alone)",
      place, HasTwoCameras(rig) ? "cameras that look apart" : "one camera"));
}

// The cameras as the run has found them. Poses are those of the body, in which the left camera
// stays where it was given: of the corrections only those of the cameras themselves apply.
Rig CamerasAsFound(const OdometryRun& run) {
  if (run.calibration.empty()) return run.source->raw_rig;
  CalibrationEstimate cameras = run.calibration.back();
  cameras.time_offset_s = 0;
  cameras.imu_rotation_rad.setZero();
  cameras.lever_m.setZero();
  cameras.imu_errors.setZero();
  return CalibratedRig(run.source->raw_rig, run.rectified_rig, cameras);
}

// Where a file of the recording is; runs name them relative to the recording.
std::string MakePath(const std::string& file, const std::string& place) {
  return file.empty() ? "" : (fs::path(place) / file).string();
}

void RequireSomeFile(const RunImages& recorded, const std::vector<ViewFiles>& files) {
  if (std::ranges::any_of(
          files, [&](const ViewFiles& each) { return recorded.store->Has(each.left_path); })) {
    return;
  }
  throw DataError(fmt::format(
      "{}: found none of the {} images of the run's keyframes, such as {}, expected the recording "
      "where it was (--sequence names where it moved to, --sparse maps without images)",
      recorded.place, files.size(), files.empty() ? "" : files.front().left_path));
}

RunImages FindRecording(const OdometryRun& run, const std::string& sequence) {
  if (!run.source) {
    throw DataError(
        "run: found nothing about where its images are, expected a run of a recording "
        "(--sparse maps without images)");
  }
  RequireStereo(run.source->sequence, run.source->raw_rig);
  const std::string place =
      sequence.empty() ? run.source->sequence : LocateRecording(sequence, false);
  return {place, OpenImageStore(place, run.source->opened)};
}

// Of a pair of cameras.
std::map<int64_t, ViewFiles> FilesByStamp(const OdometryRun& run, const std::string& place,
                                          int left_camera = 0) {
  std::map<int64_t, ViewFiles> files_at;
  for (const StereoEntry& images : run.source->images) {
    if (left_camera > 0 && images.path(left_camera).empty()) continue;
    files_at[images.stamp_ns] = {MakePath(images.path(left_camera), place),
                                 MakePath(images.path(left_camera + 1), place), left_camera};
  }
  return files_at;
}

std::vector<PixelForm> ReadPixelForms(const OdometryRun& run, const RunImages& recorded,
                                      ImageCache* cache) {
  auto paths = ImagePaths(run.source->images, run.source->raw_rig.cameras.size());
  for (auto& of_camera : paths) {
    for (std::string& path : of_camera) path = MakePath(path, recorded.place);
  }
  return cache->FindForms(*recorded.store, paths);
}

// Of the keyframes in their order; some are there.
std::vector<ViewFiles> KeyframeFiles(const OdometryRun& run, const RunImages& recorded,
                                     const std::map<int64_t, ViewFiles>& files_at) {
  std::vector<ViewFiles> files;
  for (const Keyframe& keyframe : run.keyframes) {
    const auto at = files_at.find(keyframe.stamp_ns);
    files.push_back(at == files_at.end() ? ViewFiles() : at->second);
  }
  RequireSomeFile(recorded, files);
  return files;
}

bool IsFarEnough(const RigidTransform& from, const RigidTransform& to,
                 const KeyframeSelection& selection) {
  return (to.translation - from.translation).norm() >= selection.min_travel_m ||
         from.rotation.angularDistance(to.rotation) >= selection.min_turn_rad;
}

using StampSpan = std::pair<int64_t, int64_t>;  // first and last

std::map<int, StampSpan> SpansOfSegments(const std::vector<Keyframe>& keyframes) {
  std::map<int, StampSpan> spans_ns;
  for (const Keyframe& keyframe : keyframes) {
    const int64_t stamp_ns = keyframe.stamp_ns;
    const auto [span, is_new] = spans_ns.try_emplace(keyframe.segment, stamp_ns, stamp_ns);
    span->second.first = std::min(span->second.first, stamp_ns);
    span->second.second = std::max(span->second.second, stamp_ns);
  }
  return spans_ns;
}

// The states from the first keyframe of their segment to its last. Keyframes are at their own poses
// to the last bit, those from before odometry's first state too.
Views FramesOfRun(const OdometryRun& run) {
  const std::map<int, StampSpan> spans_ns = SpansOfSegments(run.keyframes);
  std::map<std::string, int64_t> counted_elsewhere;
  const Trajectory refined = RefineTrajectory(run, &counted_elsewhere);
  std::map<std::pair<int, int64_t>, RigidTransform> poses;  // by segment and stamp
  for (size_t i = 0; i < refined.size(); ++i) {
    const int segment = run.states[i].segment;
    const auto span = spans_ns.find(segment);
    if (span == spans_ns.end()) continue;
    const auto [first_ns, last_ns] = span->second;
    const int64_t stamp_ns = refined[i].stamp_ns;
    if (stamp_ns < first_ns || stamp_ns > last_ns) continue;
    poses[{segment, stamp_ns}] = refined[i].T_world_imu;
  }
  for (const Keyframe& keyframe : run.keyframes) {
    poses[{keyframe.segment, keyframe.stamp_ns}] = keyframe.T_world_imu;
  }
  Views frames;
  for (const auto& [key, T_world_imu] : poses) {
    frames.push_back({key.second, key.first, T_world_imu});
  }
  return frames;
}

// Of the poses and what they are of: the same poses of a recording that has moved have the same.
std::string IdOfPoses(const OdometryRun& run) {
  std::string contents;
  for (const OnlineState& state : run.states) {
    const Eigen::Vector3d& p = state.T_world_imu.translation;
    const Eigen::Quaterniond& q = state.T_world_imu.rotation;
    contents += fmt::format("{} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n", state.stamp_ns,
                            p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
  }
  for (const StereoEntry& images : run.source->images) {
    contents += images.left_path + ' ' + images.right_path + '\n';
  }
  return Checksum(contents);
}

// What is mapped behind a jump does not fit what was mapped before it.
void ReportJumps(const Trajectory& trajectory, OdometryRun* run) {
  std::vector<PoseJump> jumps = FindJumps(trajectory);
  std::erase_if(jumps, [&](const PoseJump& jump) {  // where nothing is mapped
    return jump.stamp_ns <= run->states.front().stamp_ns ||
           jump.from_ns >= run->states.back().stamp_ns;
  });
  if (jumps.empty()) return;
  run->warnings["pose_jumps"] += std::ssize(jumps);
  run->complete = false;
  run->partial_reason = fmt::format(
      "poses jump {} times, besides their motion: first by {:.2f} m and {:.1f} degrees "
      "at {:.3f} s",
      jumps.size(), jumps[0].moved_m, jumps[0].turned_rad * 180 / M_PI,
      ToSeconds(jumps[0].stamp_ns));
}

// Poses that are at the time of the images, but at none of them.
void RefusePosesBetween(const Sequence& recording, const Trajectory& trajectory,
                        const KeyframeSelection& selection) {
  std::vector<double> off_s;
  for (const StampedPose& pose : trajectory) {
    double least_s = INFINITY;
    for (const StereoEntry& pair : recording.images) {
      const double apart_s = ToSeconds(pair.stamp_ns - pose.stamp_ns);
      if (std::abs(apart_s) < std::abs(least_s)) least_s = apart_s;
    }
    off_s.push_back(least_s);
  }
  const bool is_of_the_time = trajectory.back().stamp_ns > recording.images.front().stamp_ns &&
                              trajectory.front().stamp_ns < recording.images.back().stamp_ns;
  if (!is_of_the_time) return;
  const double middle_s = Quantile(off_s, 0.5);
  throw DataError(fmt::format(
      "{}: found poses {:.2g} s apart, and the images nearest to them {:.1f} ms away (median), "
      "expected poses within {:.0f} ms of images, or on both sides of them at most {:.1f} s apart: "
      "write poses at the stamps of images; or, if the clocks differ by that, give "
      "--poses-offset={:.4f}",
      recording.folder, MedianPeriod_s(trajectory), 1e3 * std::abs(middle_s),
      1e3 * selection.max_stamp_offset_s, selection.max_pose_gap_s, middle_s));
}

[[noreturn]] void RefusePoses(const Sequence& recording, const Trajectory& trajectory) {
  throw DataError(fmt::format(
      "{}: found poses from {:.3f} to {:.3f} s and images from {:.3f} to {:.3f} s, expected poses "
      "at the images (are they of this recording, and of its clock?)",
      recording.folder, ToSeconds(trajectory.front().stamp_ns),
      ToSeconds(trajectory.back().stamp_ns), ToSeconds(recording.images.front().stamp_ns),
      ToSeconds(recording.images.back().stamp_ns)));
}

}  // namespace

cv::Mat ImageCache::Read(const ImageStore& images, const std::string& path, const cv::Size& size,
                         const PixelForm& form) {
  constexpr size_t kMostBytes = size_t{1} << 30;
  {
    const std::lock_guard lock(mutex_);
    if (const auto known = kept_.find(path); known != kept_.end()) return known->second;
  }
  const cv::Mat image = ReadGrayImage(images, path, size, form).image;
  const size_t bytes = image.total();
  const std::lock_guard lock(mutex_);
  if (bytes > 0 && kept_bytes_ + bytes <= kMostBytes && kept_.try_emplace(path, image).second) {
    kept_bytes_ += bytes;
  }
  return image;
}

std::vector<PixelForm> ImageCache::FindForms(const ImageStore& images,
                                             const std::vector<std::vector<std::string>>& paths) {
  const std::lock_guard lock(mutex_);
  if (!forms_) forms_ = FindPixelForms(images, paths);
  return *forms_;
}

RecordedViews ViewsForLines(const RecordedViews& recorded, const ViewSpacingOptions& options) {
  const bool has_frames = !recorded.frames.empty();
  const Views& frames = has_frames ? recorded.frames : recorded.views;
  const std::vector<size_t> selected = SelectViews(frames, recorded.views, options);
  RecordedViews chosen;
  for (const size_t frame : selected) chosen.views.push_back(frames[frame]);
  chosen.images = std::make_unique<SelectedImages>(
      has_frames ? *recorded.frame_images : *recorded.images, selected);
  return chosen;
}

std::unique_ptr<ViewImages> KeyframeImages(const OdometryRun& run, const std::string& sequence,
                                           const SharedImageCache& cache) {
  const RunImages recorded = FindRecording(run, sequence);
  const std::map<int64_t, ViewFiles> files_at = FilesByStamp(run, recorded.place);
  return std::make_unique<RecordedImageReader>(
      CamerasAsFound(run), RectifierOptions(), ReadPixelForms(run, recorded, cache.get()),
      recorded.store, KeyframeFiles(run, recorded, files_at), cache,
      std::make_shared<LostImages>());
}

std::unique_ptr<ViewImages> OpenImages(const Sequence& recording,
                                       const std::vector<size_t>& pairs) {
  std::vector<ViewFiles> files;
  for (const size_t pair : pairs) {
    files.push_back({recording.images[pair].left_path, recording.images[pair].right_path});
  }
  return std::make_unique<RecordedImageReader>(
      recording.rig, RectifierOptions(), recording.pixel_forms, recording.store, std::move(files),
      std::make_shared<ImageCache>(), std::make_shared<LostImages>());
}

std::string StatesOfImages(const OdometryRun& run, const std::string& sequence) {
  const RunImages recorded = FindRecording(run, sequence);
  const std::string place = fs::weakly_canonical(recorded.place).string();
  std::string states = place + '\n';
  for (const StereoEntry& images : run.source->images) {
    for (int camera = 0; camera < CameraCount(run.source->raw_rig); ++camera) {
      const std::string& file = images.path(camera);
      if (file.empty()) continue;  // of a pair whose right image is not used
      states += fmt::format("{} {}\n", file, recorded.store->State(MakePath(file, place)));
    }
  }
  return states;
}

RecordedViews ViewsOfRun(const OdometryRun& run, const std::string& sequence,
                         const SharedImageCache& cache) {
  const RunImages from = FindRecording(run, sequence);
  const Rig rig = CamerasAsFound(run);
  const std::vector<PixelForm> forms = ReadPixelForms(run, from, cache.get());
  const auto lost = std::make_shared<LostImages>();
  const Views frames = FramesOfRun(run);
  RecordedViews recorded;
  std::vector<ViewFiles> files, frame_files;
  for (const auto& [left_camera, is_pair] : CameraGroups(rig)) {
    if (!is_pair) continue;  // shows no depth
    std::map<int64_t, ViewFiles> files_at = FilesByStamp(run, from.place, left_camera);
    const std::vector<ViewFiles> of_keyframes = KeyframeFiles(run, from, files_at);
    for (size_t i = 0; i < of_keyframes.size(); ++i) {
      const Keyframe& keyframe = run.keyframes[i];
      if (left_camera > 0 && of_keyframes[i].left_path.empty()) continue;
      recorded.views.push_back(
          {keyframe.stamp_ns, keyframe.segment, keyframe.T_world_imu, left_camera});
      files.push_back(of_keyframes[i]);
    }
    for (View frame : frames) {
      const ViewFiles& pair = files_at[frame.stamp_ns];
      if (!from.store->Has(pair.left_path)) {
        if (left_camera == 0 || !pair.left_path.empty()) lost->Add(pair.left_path);
        continue;
      }
      frame.left_camera = left_camera;
      recorded.frames.push_back(frame);
      frame_files.push_back(pair);
    }
  }
  recorded.images = std::make_unique<RecordedImageReader>(
      rig, RectifierOptions(), forms, from.store, std::move(files), cache, lost);
  recorded.frame_images = std::make_unique<RecordedImageReader>(
      rig, RectifierOptions{.scale = 1}, forms, from.store, std::move(frame_files), cache, lost);
  recorded.lost = lost;
  return recorded;
}

OdometryRun RunAtPoses(const std::string& sequence, SequenceOptions options,
                       const Trajectory& trajectory, const KeyframeSelection& selection) {
  options.needs_imu = false;
  const Sequence recording = OpenSequence(sequence, options);
  RequireStereo(recording.folder, recording.rig);
  OdometryRun run;
  run.method = kExternalPoses;
  run.complete = true;
  RunSource& source = run.source.emplace();
  source.sequence = fs::weakly_canonical(recording.folder).string();
  source.calibration = recording.calibration_source;
  source.raw_rig = recording.rig;
  source.opened = recording.opened;
  run.rectified_rig = Rectifier(recording.rig, RectifierOptions()).rectified_rig();
  for (const StereoEntry& pair : recording.images) {
    const auto T_world_imu =
        PoseNear(trajectory, pair.stamp_ns, selection.max_pose_gap_s, selection.max_stamp_offset_s);
    if (!T_world_imu) {
      ++run.warnings[kImageWithoutPose];
      continue;
    }
    run.source->images.push_back({pair.stamp_ns, PathWithin(pair.left_path, recording.folder),
                                  PathWithin(pair.right_path, recording.folder)});
    for (const std::string& path : pair.other_paths) {
      run.source->images.back().other_paths.push_back(PathWithin(path, recording.folder));
    }
    run.states.push_back({.stamp_ns = pair.stamp_ns, .T_world_imu = *T_world_imu});
    if (run.keyframes.empty() ||
        IsFarEnough(run.keyframes.back().T_world_imu, *T_world_imu, selection)) {
      const auto id = static_cast<int64_t>(run.keyframes.size());
      run.keyframes.push_back({id, 0, pair.stamp_ns, *T_world_imu, {}, {}});
    }
  }
  if (run.states.empty()) {
    RefusePosesBetween(recording, trajectory, selection);
    RefusePoses(recording, trajectory);
  }
  ReportJumps(trajectory, &run);
  run.id = IdOfPoses(run);
  return run;
}

}  // namespace slcmap::mapping
