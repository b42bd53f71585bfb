// Whether the images can be read, and show something that changes.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <opencv2/core.hpp>

#include "data/calibration.h"
#include "data/check/check.h"
#include "data/image_file.h"

namespace slcmap {
namespace {

constexpr size_t kSamples = 24;    // places in the sequence
constexpr double kMinMean = 4;     // grey levels; a black image is below
constexpr double kMinSpread = 2;   // grey levels of standard deviation; a covered lens is below
constexpr double kMaxMean = 250;   // a blinded camera is above
constexpr double kMaxShare = 0.5;  // of bad samples in a sequence that is of use

struct CameraCounts {
  int sampled = 0, dark = 0, bright = 0;
};

void Look(const cv::Mat& image, CameraCounts* counts) {
  cv::Scalar mean, spread;
  cv::meanStdDev(image, mean, spread);
  ++counts->sampled;
  counts->dark += mean[0] < kMinMean || spread[0] < kMinSpread;
  counts->bright += mean[0] > kMaxMean;
}

// Adds a finding when some of the samples are bad; an error when most are.
void Judge(const std::string& name, const std::string& what, int bad, int sampled,
           const std::string& remedy, CheckReport* report) {
  if (bad == 0) return;
  const std::string found = fmt::format("{} of {} sampled images {}", bad, sampled, what);
  if (bad > kMaxShare * sampled) {
    report->Fail(name, found, remedy);
  } else {
    report->Warn(name, found, remedy);
  }
}

const char* ProblemRemedy(const std::string& problem) {
  if (problem == kImageWrongSize) return "calibrate for these images, or scale them back";
  if (problem == kImageMissing) return "copy the sequence again, or correct the file column";
  return "copy the sequence again; such images are skipped";
}

void CheckFiles(const Sequence& sequence, CheckReport* report) {
  int64_t missing = 0;
  std::string first;
  for (const StereoEntry& pair : sequence.images) {
    for (const std::string& path : {pair.left_path, pair.right_path}) {
      if (path.empty() || std::filesystem::exists(path)) continue;
      if (missing++ == 0) first = path;
    }
  }
  if (missing == 0) return;
  const std::string found = fmt::format("{} image files missing, first {}", missing, first);
  if (missing > kMaxShare * static_cast<double>(sequence.images.size())) {
    report->Fail("images-missing", found, ProblemRemedy(kImageMissing));
  } else {
    report->Warn("images-missing", found, ProblemRemedy(kImageMissing));
  }
}

}  // namespace

void CheckImages(const Sequence& sequence, CheckReport* report) {
  CheckFiles(sequence, report);
  std::array<CameraCounts, 2> counts;
  std::map<std::string, int> problems;
  int read = 0, same = 0;
  const size_t step = std::max<size_t>(1, sequence.images.size() / kSamples);
  const int cameras = IsStereo(sequence.rig) ? 2 : 1;
  for (size_t i = 0; i < sequence.images.size(); i += step) {
    const StereoEntry& pair = sequence.images[i];
    std::array<cv::Mat, 2> images;
    for (int k = 0; k < cameras; ++k) {
      const Camera& camera = sequence.rig.cameras[k];
      const ImageRead result = ReadGrayImage(k == 0 ? pair.left_path : pair.right_path,
                                             cv::Size(camera.width_px, camera.height_px));
      ++read;
      if (result.problem != nullptr) ++problems[result.problem];
      images[k] = result.image;
      if (!images[k].empty()) Look(images[k], &counts[k]);
    }
    same += !images[0].empty() && images[0].size() == images[1].size() &&
            cv::norm(images[0], images[1], cv::NORM_INF) == 0;
  }
  for (const auto& [problem, count] : problems) {
    std::string words = problem;
    std::replace(words.begin(), words.end(), '_', ' ');
    Judge("images", "are " + words, count, read, ProblemRemedy(problem), report);
  }
  for (int camera = 0; camera < cameras; ++camera) {
    const CameraCounts& seen = counts[camera];
    const std::string name = fmt::format("of cam{} ", camera);
    Judge("black-camera", name + "are black or without any contrast", seen.dark, seen.sampled,
          "uncover the lens, or raise exposure or light", report);
    Judge("bright-camera", name + "are white", seen.bright, seen.sampled, "lower the exposure",
          report);
  }
  Judge("same-images", "are the same left and right", same, counts[0].sampled,
        "record two cameras, not one twice", report);
}

}  // namespace slcmap
