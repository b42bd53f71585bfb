#include "data/check/check.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <map>

#include "data/calibration.h"
#include "data/error.h"

namespace slcmap {
namespace {

constexpr double kMinImageRate_hz = 8, kMinImuRate_hz = 80;
constexpr double kMaxImageGapSteps = 1.5;
constexpr double kMaxRateMismatch = 0.2;  // of the IMU's rate against its calibration
constexpr double kMinCovered = 0.9;       // share of the images that have IMU samples

struct Remedy {
  const char* kind;
  const char* name;
  const char* remedy;
};
constexpr Remedy kRemedies[] = {
    {kRowUnreadable, "rows", "write each row as the header of data.csv says; the row is skipped"},
    {kRowNotFinite, "rows", "remove the rows with NaN at their source; they are skipped"},
    {kStampUnsorted, "stamps", "sort data.csv by stamp and remove repeated rows; they are skipped"},
    {kImuGap, "imu-gaps", "record the IMU without loss (buffer, USB bandwidth); accuracy suffers"},
    {kImageUnpaired, "unpaired", "trigger both cameras together; single images are skipped"},
    {kImuNoiseAssumed, "imu-noise",
     "give the IMU's noise in imu0/sensor.yaml or a Kalibr imu.yaml"},
};

// Adds rate, duration and gaps of the pairs.
void CheckImageStamps(const std::vector<StereoEntry>& images, CheckReport* report) {
  const double step_s = MedianStep_s(images);
  report->AddFigure("stereo pairs", static_cast<double>(images.size()), "");
  report->AddFigure("duration", ToSeconds(images.back().stamp_ns - images.front().stamp_ns), "s");
  if (step_s <= 0) return;
  report->AddFigure("image rate", 1 / step_s, "Hz");
  int gaps = 0;
  double longest_s = 0;
  for (size_t i = 1; i < images.size(); ++i) {
    const double gap_s = ToSeconds(images[i].stamp_ns - images[i - 1].stamp_ns);
    gaps += gap_s > kMaxImageGapSteps * step_s;
    longest_s = std::max(longest_s, gap_s);
  }
  report->AddFigure("longest step between pairs", longest_s, "s");
  if (gaps > 0) {
    report->Warn("image-gaps", fmt::format("{} gaps, the longest {:.3f} s", gaps, longest_s),
                 "record without loss of images (disk speed, USB bandwidth)");
  }
  if (1 / step_s < kMinImageRate_hz) {
    report->Warn("image-rate", fmt::format("{:.1f} Hz", 1 / step_s),
                 "record at 15 to 30 Hz, so that points can be followed");
  }
}

void CheckImuRate(const Sequence& sequence, CheckReport* report) {
  const double step_s = MedianStep_s(sequence.imu);
  report->AddFigure("IMU samples", static_cast<double>(sequence.imu.size()), "");
  if (step_s <= 0) return;
  const double rate_hz = 1 / step_s, calibrated_hz = sequence.rig.imu_noise.rate_hz;
  report->AddFigure("IMU rate", rate_hz, "Hz");
  if (rate_hz < kMinImuRate_hz) {
    report->Warn("imu-rate", fmt::format("{:.1f} Hz", rate_hz), "record the IMU at 200 Hz or more");
  }
  if (std::abs(rate_hz / calibrated_hz - 1) > kMaxRateMismatch) {
    report->Warn("imu-rate",
                 fmt::format("{:.1f} Hz, {:.1f} Hz in the calibration", rate_hz, calibrated_hz),
                 "correct rate_hz (ASL) or update_rate (Kalibr)");
  }
}

void CheckImuCover(const Sequence& sequence, CheckReport* report) {
  const int64_t offset_ns = ToNanoseconds(sequence.rig.camera_time_offset_s);
  const auto covered =
      std::count_if(sequence.images.begin(), sequence.images.end(), [&](const StereoEntry& pair) {
        const int64_t stamp_ns = pair.stamp_ns + offset_ns;
        return stamp_ns >= sequence.imu.front().stamp_ns &&
               stamp_ns <= sequence.imu.back().stamp_ns;
      });
  const double share = static_cast<double>(covered) / static_cast<double>(sequence.images.size());
  report->AddFigure("pairs with IMU samples around them", 100 * share, "%");
  const std::string found = fmt::format(
      "{} of {} pairs are outside the time of the IMU samples",
      static_cast<std::ptrdiff_t>(sequence.images.size()) - covered, sequence.images.size());
  if (share < kMinCovered) {
    report->Fail("imu-cover", found, "record both at the same time, with stamps of one clock");
  } else if (share < 1) {
    report->Warn("imu-cover", found, "start the IMU before the cameras and stop it after them");
  }
}

}  // namespace

void CheckWarnings(const Warnings& warnings, CheckReport* report) {
  for (const Remedy& remedy : kRemedies) {
    const auto found = warnings.entries().find(remedy.kind);
    if (found == warnings.entries().end()) continue;
    std::string words = remedy.kind;
    std::replace(words.begin(), words.end(), '_', ' ');
    report->Warn(
        remedy.name,
        fmt::format("{} {}, first {}", found->second.count, words, found->second.first_place),
        remedy.remedy);
  }
}

void CheckCameras(const Rig& rig, CheckReport* report) {
  if (IsStereo(rig)) return;
  report->Warn("one-camera", "no right camera", "run odometry with --method points-mono");
}

void CheckStamps(const Sequence& sequence, CheckReport* report) {
  CheckImageStamps(sequence.images, report);
  CheckImuRate(sequence, report);
  CheckImuCover(sequence, report);
}

CheckReport CheckSequence(const std::string& path, const SequenceOptions& options) {
  CheckReport report;
  report.sequence = path;
  Sequence sequence;
  try {
    sequence = OpenSequence(path, options);
  } catch (const DataError& error) {
    report.Fail("unreadable", error.what(),
                "lay the sequence out as EuRoC does: mav0/cam0, cam1, imu0, each with data.csv and "
                "sensor.yaml");
    return report;
  }
  report.calibration = sequence.calibration_source;
  CheckWarnings(sequence.warnings, &report);
  CheckCameras(sequence.rig, &report);
  CheckStamps(sequence, &report);
  CheckImu(sequence.imu, &report);
  CheckCalibration(sequence.rig, &report);
  CheckImages(sequence, &report);
  CheckRepeats(sequence, &report);
  CheckGeometry(sequence, &report);
  return report;
}

}  // namespace slcmap
