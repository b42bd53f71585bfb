#include "data/calibration/mask.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <opencv2/core.hpp>

#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "data/io/image.h"

namespace slcmap::inline data {
namespace {

constexpr double kMostLeftOut = 0.95;  // of an image: beyond, black and white are exchanged

cv::Mat ReadMask(const std::string& path, const Camera& camera) {
  const ImageRead read = ReadGrayImage(path, {});
  const auto fail = [&](const std::string& found, const std::string& remedy) {
    throw InputFault("mask", fmt::format("{}: {}", path, found), remedy);
  };
  if (read.problem != nullptr) {
    fail("found no image that can be read, expected a mask", "name a PNG image as the mask");
  }
  if (read.image.cols != camera.width_px || read.image.rows != camera.height_px) {
    fail(fmt::format("found {} x {} pixels, expected {} x {} as the camera has", read.image.cols,
                     read.image.rows, camera.width_px, camera.height_px),
         "make the mask of an image as it was recorded");
  }
  const cv::Mat mask = read.image < 128;
  if (LeftOut(mask) > kMostLeftOut) {
    fail(fmt::format("found {:.0f} % white, expected less than {:.0f} %: white is left out",
                     100 * LeftOut(mask), 100 * kMostLeftOut),
         "write 255 where nothing is to be looked at, and 0 elsewhere");
  }
  return mask;
}

}  // namespace

void ReadMasks(const std::vector<std::string>& paths, Rig* rig) {
  const auto cameras = static_cast<size_t>(CameraCount(*rig));
  if (paths.size() > cameras) {
    throw InputFault("mask",
                     fmt::format("--mask: found {} masks, expected one a camera, {} at most",
                                 paths.size(), cameras),
                     "name the left camera's mask, then the right one's, and those of others");
  }
  for (size_t i = 0; i < paths.size(); ++i) {
    if (paths[i] != kNoMask) rig->masks[i] = ReadMask(paths[i], rig->cameras[i]);
  }
  const auto is_given = [](const cv::Mat& mask) { return !mask.empty(); };
  const auto leaves_out = [](const cv::Mat& mask) { return LeftOut(mask) > 0; };
  if (std::ranges::any_of(rig->masks, is_given) && std::ranges::none_of(rig->masks, leaves_out)) {
    throw InputFault(
        "mask",
        fmt::format("{}: found no white, expected white where nothing is to be looked at",
                    fmt::join(paths, ",")),
        "write 255 where nothing is to be looked at, or give --mask none");
  }
}

double LeftOut(const cv::Mat& mask) {
  if (mask.empty()) return 0;
  return 1 - static_cast<double>(cv::countNonZero(mask)) / static_cast<double>(mask.total());
}

std::vector<int> CollectRuns(const cv::Mat& mask) {
  std::vector<int> runs;
  if (mask.empty()) return runs;
  bool seen = true;
  runs.push_back(0);
  for (int v = 0; v < mask.rows; ++v) {
    for (int u = 0; u < mask.cols; ++u) {
      if ((mask.at<uchar>(v, u) != 0) != seen) {
        seen = !seen;
        runs.push_back(0);
      }
      ++runs.back();
    }
  }
  return runs;
}

cv::Mat MaskOfRuns(const std::vector<int>& runs, const Camera& camera, const std::string& place) {
  if (runs.empty()) return {};
  const int64_t pixels = int64_t{camera.width_px} * camera.height_px;
  int64_t count = 0;
  for (const int run : runs) {
    count += run;
    if (run < 0 || count > pixels) break;
  }
  if (count != pixels || *std::min_element(runs.begin(), runs.end()) < 0) {
    throw DataError(
        fmt::format("{}: mask: found runs of {} pixels, expected {}", place, count, pixels));
  }
  cv::Mat mask(camera.height_px, camera.width_px, CV_8UC1);
  uchar* next = mask.ptr();
  for (size_t i = 0; i < runs.size(); ++i) {
    next = std::fill_n(next, runs[i], static_cast<uchar>(i % 2 == 0 ? 255 : 0));
  }
  return mask;
}

}  // namespace slcmap::data
