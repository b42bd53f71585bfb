// Whether the images can be read, and show something that changes.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
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

// Returns the mean.
double Look(const cv::Mat& image, CameraCounts* counts) {
  cv::Scalar mean, spread;
  cv::meanStdDev(image, mean, spread);
  ++counts->sampled;
  counts->dark += mean[0] < kMinMean || spread[0] < kMinSpread;
  counts->bright += mean[0] > kMaxMean;
  return mean[0];
}

// Adds a finding when some of `total` are bad; an error when most are.
void Judge(const std::string& name, const std::string& what, int64_t bad, int64_t total,
           const std::string& detail, const std::string& remedy, CheckReport* report) {
  if (bad == 0) return;
  const std::string found = fmt::format("{}: {} of {} {}", what, bad, total, detail);
  if (static_cast<double>(bad) > kMaxShare * static_cast<double>(total)) {
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

int CameraCount(const SequenceSource& source) { return IsStereo(source.info().rig) ? 2 : 1; }

// How many images have a problem, and the first of them.
struct Problem {
  int64_t count = 0;
  std::string first_place;
};
using Problems = std::map<std::string, Problem>;

void Count(const char* problem, const std::string& place, Problems* problems) {
  if (problem == nullptr) return;
  Problem& counted = (*problems)[problem];
  if (counted.count++ == 0) counted.first_place = place;
}

void Judge(const Problems& problems, int64_t total, const std::string& images,
           CheckReport* report) {
  for (const auto& [problem, counted] : problems) {
    Judge(problem == kImageMissing ? "images-missing" : "images", Warnings::InWords(problem),
          counted.count, total, images + ", first " + counted.first_place, ProblemRemedy(problem),
          report);
  }
}

// How much brighter or darker, as a factor, an image of a mean is than the one before, at most, and
// the next ones.
double LargestSwing(const SequenceSource& source, size_t pair, int camera, double mean) {
  constexpr size_t kNext = 3;
  constexpr double kMaxApart_s = 0.2;  // else what is seen may be another place
  const std::vector<int64_t>& stamps_ns = source.info().pair_stamps_ns;
  double largest = 1;
  for (size_t i = pair + 1; i < std::min(pair + kNext, stamps_ns.size()); ++i) {
    if (ToSeconds(stamps_ns[i] - stamps_ns[i - 1]) > kMaxApart_s) break;
    const cv::Mat image = source.ReadImage(i, camera).image;
    const double next = image.empty() ? 0 : cv::mean(image)[0];
    if (next >= kMinMean && mean >= kMinMean) {
      largest = std::max({largest, next / mean, mean / next});
    }
    mean = next;
  }
  return largest;
}

// Of the brightness, at a pair and the next ones, as a factor.
struct Swing {
  size_t pair;
  double largest;
};

// What the pixels of a sample of the images show.
struct Sample {
  std::array<CameraCounts, 2> cameras;
  std::array<std::vector<Swing>, 2> swings;  // where there are enough images
  Problems problems;  // that only decoding finds
  int64_t images = 0, pairs = 0, same = 0;
};

Sample LookAtSample(const SequenceSource& source, const Progress& progress) {
  Sample sample;
  const size_t pairs = source.info().pair_stamps_ns.size();
  for (size_t i = 0; i < pairs; i += std::max<size_t>(1, pairs / kSamples)) {
    progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(pairs));
    std::array<cv::Mat, 2> images;
    for (int camera = 0; camera < CameraCount(source); ++camera) {
      if (source.FindProblem(i, camera) != nullptr) continue;  // is a finding already
      const ImageRead read = source.ReadImage(i, camera);
      ++sample.images;
      Count(read.problem, source.ImagePlace(i, camera), &sample.problems);
      images[camera] = read.image;
      if (read.image.empty()) continue;
      const double mean = Look(read.image, &sample.cameras[camera]);
      if (pairs > kSamples) {
        sample.swings[camera].push_back({i, LargestSwing(source, i, camera, mean)});
      }
    }
    if (images[0].empty() || images[0].size() != images[1].size()) continue;
    ++sample.pairs;
    sample.same += cv::norm(images[0], images[1], cv::NORM_INF) == 0;
  }
  return sample;
}

// Exposure that swings to and fro, from when on.
void JudgeExposure(const SequenceSource& source, const Sample& sample, CheckReport* report) {
  constexpr double kSwing = 1.3;
  constexpr int kMinSwings = 3;
  const std::vector<int64_t>& stamps_ns = source.info().pair_stamps_ns;
  for (int camera = 0; camera < CameraCount(source); ++camera) {
    std::vector<size_t> swings;
    double largest = 1;
    for (const Swing& swing : sample.swings[camera]) {
      if (swing.largest > kSwing) swings.push_back(swing.pair);
      largest = std::max(largest, swing.largest);
    }
    if (std::ssize(swings) < kMinSwings) continue;
    report->Warn("exposure",
                 fmt::format("the brightness of {} swings by up to {:.1f} from one image to the "
                             "next at {} of {} sampled places, from about {:.1f} s on",
                             source.info().cameras[camera], largest, swings.size(),
                             sample.swings[camera].size(),
                             ToSeconds(stamps_ns[swings.front()] - stamps_ns.front())),
                 "hold exposure and gain, or slow their control down");
  }
}

}  // namespace

void CheckFiles(const SequenceSource& source, size_t step, const Progress& progress,
                CheckReport* report) {
  const size_t pairs = source.info().pair_stamps_ns.size();
  const char* sampled = step > 1 ? "sampled " : "";
  std::array<Problems, 2> problems;
  int64_t looked_at = 0, unusable = 0;
  for (size_t i = 0; i < pairs; i += step) {
    if (i % 16 == 0) progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(pairs));
    bool is_usable = true;
    for (int camera = 0; camera < CameraCount(source); ++camera) {
      const char* problem = source.FindProblem(i, camera);
      Count(problem, source.ImagePlace(i, camera), &problems[camera]);
      is_usable = is_usable && problem == nullptr;
    }
    ++looked_at;
    unusable += !is_usable;
  }
  for (int camera = 0; camera < CameraCount(source); ++camera) {
    Judge(problems[camera], looked_at,
          fmt::format("{}images of {}", sampled, source.info().cameras[camera]), report);
  }
  if (static_cast<double>(unusable) <= kMaxShare * static_cast<double>(looked_at)) return;
  report->Fail("images-unusable",
               fmt::format("{} of {} {}{} have an image that cannot be used", unusable, looked_at,
                           sampled, IsStereo(source.info().rig) ? "pairs" : "images"),
               IsStereo(source.info().rig)
                   ? "mend the images that are named; where the left ones are whole, odometry can "
                     "go on with --method points-mono"
                   : "mend the images that are named");
}

void CheckImages(const SequenceSource& source, const Progress& progress, CheckReport* report) {
  CheckFiles(source, 1, progress.Part(0, 0.5), report);
  const Sample sample = LookAtSample(source, progress.Part(0.5, 1));
  JudgeExposure(source, sample, report);
  Judge(sample.problems, sample.images, "sampled images", report);
  for (int camera = 0; camera < CameraCount(source); ++camera) {
    const CameraCounts& seen = sample.cameras[camera];
    const std::string images = "sampled images of " + source.info().cameras[camera];
    Judge("black-camera", "images black or without any contrast", seen.dark, seen.sampled, images,
          "uncover the lens, or raise exposure or light", report);
    Judge("bright-camera", "images white", seen.bright, seen.sampled, images, "lower the exposure",
          report);
  }
  Judge("same-images", "images the same left and right", sample.same, sample.pairs, "sampled pairs",
        "record two cameras, not one twice", report);
}

}  // namespace slcmap
