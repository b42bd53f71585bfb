// Views of a recording: the keyframes of a run, or what poses by anyone say.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "data/io/image.h"
#include "data/io/trajectory.h"
#include "data/source/sequence.h"
#include "mapping/views/view.h"
#include "mapping/views/views_between.h"
#include "odometry/run/run.h"

namespace slcmap::inline mapping {

// The images of a recording as their files have them, decoded once for all that look at them again:
// decoding takes five times as long as rectifying, which differs with the calibration. Those that
// come first are kept, up to 1 GB: of sweeps over all images that helps each, whereas the latest
// ones would be forgotten before the next sweep comes to them. May be used by several threads.
class ImageCache {
 public:
  // Empty where it cannot be read. Must not be written to.
  cv::Mat Read(const ImageStore& images, const std::string& path, const cv::Size& size,
               const PixelForm& form);

  // By camera, from a sample of the images: FindPixelForms().
  std::vector<PixelForm> FindForms(const ImageStore& images,
                                   const std::vector<std::vector<std::string>>& paths);

 private:
  std::mutex mutex_;
  std::unordered_map<std::string, cv::Mat> kept_;
  size_t kept_bytes_ = 0;
  std::optional<std::vector<PixelForm>> forms_;
};

using SharedImageCache = std::shared_ptr<ImageCache>;

struct RecordedViews {
  Views views;
  std::unique_ptr<ViewImages> images;
  // All images of a run whose files are there, from the first keyframe of a segment to its last, at
  // their refined poses: the views are among them. None where views are not of a run. Their images
  // are as fine as the cameras', those of the views somewhat coarser (RectifierOptions::scale).
  Views frames;
  std::unique_ptr<ViewImages> frame_images;
  // Of views and frames, as far as they were looked for; none where images are of no files.
  std::shared_ptr<const LostImages> lost;
};

// The keyframes of a run with their images, in the recording where it was or, where that has moved,
// in `sequence` (not empty): a folder or a bag. Images are rectified with what the run found of the
// cameras' calibration. Throws DataError when the run does not say where its images are, is of one
// camera, or when none of these is there; keyframes without images are views without.
RecordedViews ViewsOfRun(const OdometryRun& run, const std::string& sequence,
                         const SharedImageCache& cache = std::make_shared<ImageCache>());

// Keyframes and, where there are frames, those of them that are in between, with the frames'
// images. `recorded` must outlive them.
RecordedViews ViewsForLines(const RecordedViews& recorded, const ViewSpacingOptions& options);

// The images of the keyframes alone, in their order, as ViewsOfRun() has them. They are read when
// they are asked for.
std::unique_ptr<ViewImages> KeyframeImages(
    const OdometryRun& run, const std::string& sequence,
    const SharedImageCache& cache = std::make_shared<ImageCache>());

// The images of some pairs of a recording, in their order, rectified with its calibration.
std::unique_ptr<ViewImages> OpenImages(const Sequence& recording, const std::vector<size_t>& pairs);

// What tells images that were changed since from those that were there, in the recording that
// ViewsOfRun() reads: their paths, sizes and times of their last change.
std::string StatesOfImages(const OdometryRun& run, const std::string& sequence);

// Which images of a recording become keyframes when poses are given.
struct KeyframeSelection {
  double min_travel_m = 0.1;          // from the keyframe before, or
  double min_turn_rad = 0.15;         // as much as that
  double max_pose_gap_s = 0.1;        // between poses that one is interpolated from
  double max_stamp_offset_s = 0.005;  // to a pose that is taken as it is: none on both sides
};

// The run of an odometry that was done by somebody else: a state at each image of a recording
// (IMU data are not needed) that the trajectory covers, and keyframes among them without
// observations; its method is kExternalPoses (odometry/run/run.h), and its id is a checksum of the
// poses and of the images' names. It is partial where the poses jump. Throws DataError when the
// recording cannot be used, or no pose is at an image.
OdometryRun RunAtPoses(const std::string& sequence, SequenceOptions options,
                       const Trajectory& trajectory, const KeyframeSelection& selection = {});

// Counts images that the poses do not cover, as a warning of the run.
inline constexpr const char* kImageWithoutPose = "images_without_pose";

}  // namespace slcmap::mapping
