// Whether the images can be read, and show something that changes.
// Units of the IMU, by gravity and by the agreement of gyroscope and accelerometer.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <opencv2/core.hpp>

#include "data/calibration/calibration.h"
#include "data/check/check.h"
#include "data/core/math.h"
#include "data/core/types.h"
#include "data/io/image.h"
#include "data/source/asl_files.h"

namespace slcmap::inline data {
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

int CameraCount(const SequenceSource& source) { return CameraCount(source.info().rig); }

// How many images have a problem, and the first of them.
using Problems = std::map<std::string, Warnings::Entry>;

void Count(const char* problem, const std::string& place, Problems* problems) {
  if (problem == nullptr) return;
  Warnings::Entry& counted = (*problems)[problem];
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
  std::vector<CameraCounts> cameras;
  std::vector<std::vector<Swing>> swings;  // by camera, where there are enough images
  Problems problems;                       // that only decoding finds
  int64_t images = 0, pairs = 0, same = 0;
};

Sample LookAtSample(const SequenceSource& source, const Progress& progress) {
  Sample sample;
  sample.cameras.resize(source.info().rig.cameras.size());
  sample.swings.resize(sample.cameras.size());
  const size_t pairs = source.info().pair_stamps_ns.size();
  for (size_t i = 0; i < pairs; i += std::max<size_t>(1, pairs / kSamples)) {
    progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(pairs));
    std::vector<cv::Mat> images(sample.cameras.size());
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
  std::vector<Problems> problems(source.info().rig.cameras.size());
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

namespace {

constexpr double kMean_s = 0.25;        // accelerometer readings averaged for a direction
constexpr double kBetween_s = 1.0;      // between two directions that are compared
constexpr double kMinGyro_deg = 5;      // error that makes the unit doubtful
constexpr double kMaxStuckShare = 0.5;  // of samples equal to the one before
constexpr double kMaxAbsurdShare = 0.1;
constexpr double kMaxHeld_s = 1;           // of one axis at one value, while the others change
constexpr double kMaxUsualTurn_rad_s = 2;  // median; a gyroscope in deg/s is above

// The mean specific force over kMean_s from sample `first`, and the next sample after it.
struct Direction {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  size_t centre = 0;
  size_t end = 0;
};

Direction MeanForce(const std::vector<ImuSample>& samples, size_t first) {
  Direction direction;
  size_t i = first;
  for (; i < samples.size() && ToSeconds(samples[i].stamp_ns - samples[first].stamp_ns) <= kMean_s;
       ++i) {
    direction.mean += samples[i].specific_force_m_s2;
  }
  direction.mean /= static_cast<double>(i - first);
  direction.centre = (first + i) / 2;
  direction.end = i;
  return direction;
}

// The median angle between gravity as measured and as turned there by the gyroscope, whose values
// are in units of `unit_rad_s`.
double GravityDrift_rad(const std::vector<ImuSample>& samples, double unit_rad_s) {
  std::vector<double> angles_rad;
  size_t first = 0;
  while (first < samples.size()) {
    const Direction before = MeanForce(samples, first);
    size_t second = before.end;
    while (second < samples.size() &&
           ToSeconds(samples[second].stamp_ns - samples[first].stamp_ns) < kBetween_s) {
      ++second;
    }
    if (second >= samples.size()) break;
    const Direction after = MeanForce(samples, second);
    Eigen::Quaterniond R_before_after = Eigen::Quaterniond::Identity();
    for (size_t i = before.centre; i < after.centre && i + 1 < samples.size(); ++i) {
      const double step_s = ToSeconds(samples[i + 1].stamp_ns - samples[i].stamp_ns);
      R_before_after =
          R_before_after * ExpRotation(samples[i].angular_velocity_rad_s * (unit_rad_s * step_s));
    }
    const Eigen::Vector3d turned = R_before_after * after.mean;
    angles_rad.push_back(std::atan2(before.mean.cross(turned).norm(), before.mean.dot(turned)));
    first = second;
  }
  return Median(angles_rad);
}

void CheckGravity(const std::vector<ImuSample>& samples, CheckReport* report) {
  std::vector<double> norms;
  for (const ImuSample& sample : samples) norms.push_back(sample.specific_force_m_s2.norm());
  const double median_m_s2 = Median(norms);
  report->AddFigure("median size of the specific force", median_m_s2, "m/s^2");
  const std::string found =
      fmt::format("a median specific force of {:.3g}, expected about 9.81 m/s^2", median_m_s2);
  if (median_m_s2 > 0.8 && median_m_s2 < 1.25) {
    report->Fail("imu-units", found, "the accelerometer seems to be in g: multiply by 9.80665");
  } else if (median_m_s2 > 800 && median_m_s2 < 1250) {
    report->Fail("imu-units", found,
                 "the accelerometer seems to be in mg or cm/s^2: bring it to m/s^2");
  } else if (median_m_s2 < 0.8) {
    report->Fail("imu-gravity", found, "gravity seems to be removed: record the raw accelerometer");
  } else if (median_m_s2 < 7.5 || median_m_s2 > 13) {
    report->Fail("imu-gravity", found, "check the accelerometer's unit and scale");
  } else if (median_m_s2 < 9.3 || median_m_s2 > 10.4) {
    report->Warn("imu-gravity", found, "calibrate the accelerometer's scale and bias");
  }
}

void CheckGyroUnit(const std::vector<ImuSample>& samples, CheckReport* report) {
  std::vector<double> rates;
  for (const ImuSample& sample : samples) rates.push_back(sample.angular_velocity_rad_s.norm());
  report->AddFigure("median turn rate", Median(rates), "rad/s");
  const double as_rad = GravityDrift_rad(samples, 1), as_deg = GravityDrift_rad(samples, kDegree);
  report->AddFigure("gyroscope against gravity, over 1 s", as_rad / kDegree, "deg");
  if (as_rad > kMinGyro_deg * kDegree && as_deg < 0.5 * as_rad &&
      Median(rates) > kMaxUsualTurn_rad_s) {
    report->Fail("imu-units",
                 fmt::format("gravity is off by {:.0f} deg each second if the gyroscope is in "
                             "rad/s, by {:.1f} if in deg/s",
                             as_rad / kDegree, as_deg / kDegree),
                 "the gyroscope seems to be in deg/s: multiply by pi / 180");
  }
}

void CheckStuck(const std::vector<ImuSample>& samples, CheckReport* report) {
  int64_t equal = 0;
  for (size_t i = 1; i < samples.size(); ++i) {
    equal += samples[i].angular_velocity_rad_s == samples[i - 1].angular_velocity_rad_s &&
             samples[i].specific_force_m_s2 == samples[i - 1].specific_force_m_s2;
  }
  const double share = static_cast<double>(equal) / static_cast<double>(samples.size());
  if (share < kMaxStuckShare) return;
  report->Warn("imu-stuck",
               fmt::format("{:.0f} % of the samples repeat the one before", 100 * share),
               "check the driver; a slower sensor that is read too often does this");
}

double Reading(const ImuSample& sample, int axis) {
  return axis < 3 ? sample.angular_velocity_rad_s[axis] : sample.specific_force_m_s2[axis - 3];
}

// The longest time that an axis keeps one value, and that value.
struct Held {
  double duration_s = 0;
  double value = 0;
};

constexpr double kHeldStep_s = 0.1;

Held LongestHeld(const std::vector<ImuSample>& samples, int axis) {
  Held longest;
  size_t first = 0;
  for (size_t i = 1; i < samples.size(); ++i) {
    // Equal readings on either side of a gap say nothing of what was in between.
    const bool gap = ToSeconds(samples[i].stamp_ns - samples[i - 1].stamp_ns) > kHeldStep_s;
    if (gap || Reading(samples[i], axis) != Reading(samples[first], axis)) first = i;
    const double duration_s = ToSeconds(samples[i].stamp_ns - samples[first].stamp_ns);
    if (duration_s > longest.duration_s) longest = {duration_s, Reading(samples[i], axis)};
  }
  return longest;
}

// Axes that are dead, or freeze for a while. Where all six do, the sensor is stuck as a whole.
void CheckHeldAxes(const std::vector<ImuSample>& samples, CheckReport* report) {
  std::array<Held, 6> held;
  for (int axis = 0; axis < 6; ++axis) held[axis] = LongestHeld(samples, axis);
  const auto too_long = [](const Held& axis) { return axis.duration_s > kMaxHeld_s; };
  if (std::all_of(held.begin(), held.end(), too_long)) return;
  for (const bool gyro : {true, false}) {
    std::string words;
    for (int axis = gyro ? 0 : 3; axis < (gyro ? 3 : 6); ++axis) {
      if (!too_long(held[axis])) continue;
      words += fmt::format("{}{} is {} for {:.1f} s", words.empty() ? "" : ", ", "xyz"[axis % 3],
                           held[axis].value, held[axis].duration_s);
    }
    if (words.empty()) continue;
    const std::string sensor = gyro ? "gyroscope" : "accelerometer";
    report->Fail(gyro ? "gyro-dead" : "accel-dead",
                 fmt::format("the {}'s {}, while the IMU's other axes change", sensor, words),
                 fmt::format("check the {}'s driver and the columns of imu0/data.csv: an axis that "
                             "is dead or frozen is of no use",
                             sensor));
  }
}

// Turn rates of the size of gravity beside forces without it.
void CheckColumns(const std::vector<ImuSample>& samples, CheckReport* report) {
  std::vector<double> rates, forces;
  for (const ImuSample& sample : samples) {
    rates.push_back(sample.angular_velocity_rad_s.norm());
    forces.push_back(sample.specific_force_m_s2.norm());
  }
  const double rate = Median(rates), force = Median(forces);
  if (rate < 9.3 || rate > 10.4 || force > 5) return;
  report->Fail("imu-columns",
               fmt::format("a median turn rate of {:.3g} and a median specific force of {:.3g}, "
                           "expected about 9.81 m/s^2 of the latter",
                           rate, force),
               "the columns of gyroscope and accelerometer seem to be swapped: imu0/data.csv "
               "holds the gyroscope's first");
}

// Values such as a driver delivers that lost its place in the stream.
void CheckValues(const std::vector<ImuSample>& samples, CheckReport* report) {
  const auto absurd = [](const ImuSample& sample) { return !IsPlausible(sample); };
  const auto first = std::find_if(samples.begin(), samples.end(), absurd);
  if (first == samples.end()) return;
  const auto count = std::count_if(first, samples.end(), absurd);
  const std::string found =
      fmt::format("{} of {} samples beyond {} rad/s or {} m/s^2, the first at {:.3f} s", count,
                  samples.size(), kMaxGyro_rad_s, kMaxAccel_m_s2, ToSeconds(first->stamp_ns));
  const std::string remedy = "check the IMU's driver, cable and units; such samples are dropped";
  if (static_cast<double>(count) > kMaxAbsurdShare * static_cast<double>(samples.size())) {
    report->Fail("imu-values", found, remedy);
  } else {
    report->Warn("imu-values", found, remedy);
  }
}

}  // namespace

void CheckImu(const std::vector<ImuSample>& samples, CheckReport* report) {
  CheckStuck(samples, report);
  CheckHeldAxes(samples, report);
  CheckColumns(samples, report);
  if (!report->Usable()) return;  // what follows would take them for something else
  CheckValues(samples, report);
  CheckGravity(samples, report);
  CheckGyroUnit(samples, report);
}

}  // namespace slcmap::data
