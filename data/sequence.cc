#include "data/sequence.h"

#include <spdlog/spdlog.h>

#include <cstdlib>
#include <filesystem>

#include "data/calibration.h"
#include "data/imu_calibration.h"
#include "data/input_fault.h"
#include "data/mask.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;

void RequireOverlap(const Sequence& sequence) {
  const int64_t offset_ns = ToNanoseconds(sequence.rig.camera_time_offset_s);
  const int64_t first_image_ns = sequence.images.front().stamp_ns + offset_ns;
  const int64_t last_image_ns = sequence.images.back().stamp_ns + offset_ns;
  const int64_t first_imu_ns = sequence.imu.front().stamp_ns;
  const int64_t last_imu_ns = sequence.imu.back().stamp_ns;
  if (first_image_ns <= last_imu_ns && first_imu_ns <= last_image_ns) return;
  throw InputFault(
      "clocks",
      fmt::format("{}: found images from {:.3f} to {:.3f} s and IMU samples from {:.3f} to {:.3f} "
                  "s, expected them to overlap (are both in nanoseconds of one clock?)",
                  sequence.folder, ToSeconds(first_image_ns), ToSeconds(last_image_ns),
                  ToSeconds(first_imu_ns), ToSeconds(last_imu_ns)),
      fmt::format("write the stamps of {0}/cam0/data.csv and {0}/imu0/data.csv in nanoseconds of "
                  "one clock",
                  sequence.folder));
}

std::string CameraFolder(const Sequence& sequence, size_t camera) {
  return fmt::format("cam{}", sequence.cameras.at(camera));
}

// The images that sequence->rig has cameras for.
std::vector<StereoEntry> ReadImageList(const SequenceOptions& options, Sequence* sequence) {
  const fs::path folder(sequence->folder);
  const auto left =
      ReadAslImages((folder / CameraFolder(*sequence, 0)).string(), &sequence->warnings);
  std::vector<StereoEntry> images;
  if (!IsStereo(sequence->rig)) {
    for (const ImageFile& image : left) images.push_back({image.stamp_ns, image.path, ""});
    return images;
  }
  const auto right =
      ReadAslImages((folder / CameraFolder(*sequence, 1)).string(), &sequence->warnings);
  images = PairImages(left, right, options.max_stereo_offset_s, &sequence->warnings);
  if (images.empty()) {
    throw InputFault(
        "unpaired",
        fmt::format("{}: found no left and right image within {} s of each other among {} and {}, "
                    "expected pairs",
                    sequence->folder, options.max_stereo_offset_s, left.size(), right.size()),
        fmt::format("trigger both cameras together, and write the stamps of {0}/cam0/data.csv and "
                    "{0}/cam1/data.csv in nanoseconds of one clock",
                    sequence->folder));
  }
  return images;
}

}  // namespace

std::string FindAslFolder(const std::string& path, bool needs_imu) {
  std::error_code error;
  if (!fs::is_directory(path, error)) {
    throw InputFault("unreadable",
                     path + ": found no such folder, expected an EuRoC (ASL) or TUM VI sequence",
                     "name the folder that holds mav0, or mav0 itself");
  }
  for (const fs::path& folder : {fs::path(path), fs::path(path) / "mav0"}) {
    if (!fs::is_directory(folder / "cam0", error)) continue;
    if (needs_imu && !fs::is_directory(folder / "imu0", error)) {
      throw InputFault("unreadable",
                       folder.string() + ": found no imu0, expected cam0, cam1 and imu0",
                       "write the IMU's samples as " + (folder / "imu0" / "data.csv").string());
    }
    return folder.string();
  }
  throw InputFault("unreadable",
                   path +
                       ": found neither cam0 nor mav0/cam0, expected an EuRoC (ASL) or TUM VI "
                       "sequence",
                   "lay the sequence out as EuRoC does: mav0/cam0, cam1, imu0, each with data.csv "
                   "and sensor.yaml");
}

std::string FindTruth(const std::string& asl_folder) {
  for (const char* name : {"state_groundtruth_estimate0", "mocap0"}) {
    const fs::path path = fs::path(asl_folder) / name / "data.csv";
    std::error_code error;
    if (fs::is_regular_file(path, error)) return path.string();
  }
  return "";
}

std::vector<StereoEntry> PairImages(const std::vector<ImageFile>& left,
                                    const std::vector<ImageFile>& right, double max_offset_s,
                                    Warnings* warnings) {
  const int64_t max_offset_ns = ToNanoseconds(max_offset_s);
  std::vector<StereoEntry> pairs;
  size_t l = 0, r = 0;
  const auto offset_ns = [&](size_t i, size_t k) {
    return std::abs(left[i].stamp_ns - right[k].stamp_ns);
  };
  while (l < left.size() && r < right.size()) {
    const bool left_is_first = left[l].stamp_ns < right[r].stamp_ns;
    const bool nearer_follows = left_is_first
                                    ? l + 1 < left.size() && offset_ns(l + 1, r) < offset_ns(l, r)
                                    : r + 1 < right.size() && offset_ns(l, r + 1) < offset_ns(l, r);
    if (offset_ns(l, r) <= max_offset_ns && !nearer_follows) {
      pairs.push_back({left[l].stamp_ns, left[l].path, right[r].path});
      ++l, ++r;
    } else if (left_is_first) {
      warnings->Add(kImageUnpaired, left[l++].path);
    } else {
      warnings->Add(kImageUnpaired, right[r++].path);
    }
  }
  while (l < left.size()) warnings->Add(kImageUnpaired, left[l++].path);
  while (r < right.size()) warnings->Add(kImageUnpaired, right[r++].path);
  return pairs;
}

Sequence OpenSequence(const std::string& path, const SequenceOptions& options) {
  Sequence sequence;
  sequence.folder = FindAslFolder(path, options.needs_imu);
  const fs::path folder(sequence.folder);
  const Calibration calibration =
      options.calibration.empty()
          ? FindCalibration(sequence.folder, &sequence.warnings, options.mirrored, options.cameras)
          : ReadCalibration(options.calibration, &sequence.warnings, options.mirrored,
                            options.cameras);
  sequence.rig = calibration.rig;
  sequence.calibration_source = calibration.source;
  sequence.cameras = calibration.cameras;
  sequence.finds_carried = options.masks.empty();
  std::error_code error;
  if (IsStereo(sequence.rig) && !fs::is_directory(folder / CameraFolder(sequence, 1), error)) {
    sequence.rig.cameras[1] = Camera();
  }
  ReadMasks(options.masks, &sequence.rig);
  sequence.images = ReadImageList(options, &sequence);
  if (options.needs_imu) {
    sequence.imu = ReadAslImu((folder / "imu0" / "data.csv").string(), &sequence.warnings);
    RequireOverlap(sequence);
    Correct(sequence.rig.imu_correction, &sequence.imu);
  }
  sequence.truth_path = FindTruth(sequence.folder);
  return sequence;
}

}  // namespace slcmap
