#include "data/check/check.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "data/calibration.h"
#include "data/check/stretches.h"
#include "data/clock_jumps.h"
#include "data/imu_streams.h"
#include "data/input_fault.h"
#include "data/source/asl_source.h"
#include "data/table_text.h"

namespace slcmap {
namespace {

constexpr double kMinImageRate_hz = 8, kMinImuRate_hz = 80;
constexpr double kMaxImageGapSteps = 1.5;
constexpr double kMaxRateMismatch = 0.2;  // of the IMU's rate against its calibration
constexpr double kMinCovered = 0.9;       // share of the images that have IMU samples
constexpr size_t kStartFiles = 24;        // pairs whose files are looked at before the start

struct Remedy {
  const char* kind;
  const char* name;
  const char* remedy;
};
constexpr Remedy kRemedies[] = {
    {kRowUnreadable, "rows", "write each row as the header of data.csv says; the row is skipped"},
    {kRowNotFinite, "rows", "remove the rows with NaN at their source; they are skipped"},
    {kStampUnsorted, "stamps",
     "remove repeated and damaged rows at their source; they are skipped"},
    {kRowSorted, "stamps",
     "write the rows in the order of their stamps; they are sorted on reading"},
    {kImuGap, "imu-gaps",
     "record the IMU without loss (buffer, USB bandwidth), and let nothing set the clock forward; "
     "accuracy suffers"},
    {kImuJoined, "imu-streams",
     "record accelerometer and gyroscope as samples of both at one time, if the driver can; what "
     "was "
     "joined is of use"},
    {kImuRepeated, "imu-repeats",
     "log the IMU at its own rate: each sample is there several times; the repeats are left out"},
    {kImuOnArrival, "imu-arrival",
     "stamp samples where they are taken (in the sensor or driver); they may be late as a whole by "
     "some ms, which images tell: see the time offset, and write it as timeshift_cam_imu"},
    {kImuStampsShared, "imu-stamps",
     "stamp each sample in the sensor or driver; those that share a stamp were spread over the "
     "step "
     "beside them"},
    {kStampDigits, "stamp-digits",
     "write stamps with all their digits, as whole numbers (spreadsheets keep 15)"},
    {kImageUnpaired, "unpaired", "trigger both cameras together; single images are skipped"},
    {kClockJump, "clock",
     "let nothing set the recorder's clock while it records (NTP); what follows is put where it "
     "belongs, and starts a new segment unless the other camera's stamps tell its time"},
    {kImageFewBits, "image-bits",
     "nothing where that is so; else write true 16 bits, or 8"},
    {kImageMosaic, "mosaic", "write grey or colour images; details are blurred a little"},
    {kImageOrientation, "orientation",
     "nothing where the cameras were calibrated with images as stored; else turn the pixels, and "
     "remove the EXIF orientation"},
    {kImuNoiseAssumed, "imu-noise",
     "give the IMU's noise in imu0/sensor.yaml or a Kalibr imu.yaml"},
    {kTimeShiftsDiffer, "time-shifts",
     "write one timeshift_cam_imu for both cameras, which are triggered together; that of cam0 is "
     "taken"},
};

// A stamp as what MedianStep_s takes.
struct Stamp {
  int64_t stamp_ns;
};

std::vector<Stamp> StampsOf(const SourceInfo& info) {
  std::vector<Stamp> stamps;
  for (const int64_t stamp_ns : info.pair_stamps_ns) stamps.push_back({stamp_ns});
  return stamps;
}

// Adds rate, duration and gaps of the pairs.
void CheckImageStamps(const SourceInfo& info, CheckReport* report) {
  const std::vector<Stamp> stamps = StampsOf(info);
  const double step_s = MedianStep_s(stamps);
  report->AddFigure(IsStereo(info.rig) ? "stereo pairs" : "images",
                    static_cast<double>(stamps.size()), "");
  report->AddFigure("duration", ToSeconds(stamps.back().stamp_ns - stamps.front().stamp_ns), "s");
  if (step_s <= 0) return;
  report->AddFigure("image rate", 1 / step_s, "Hz");
  int gaps = 0;
  double longest_s = 0;
  for (size_t i = 1; i < stamps.size(); ++i) {
    const double gap_s = ToSeconds(stamps[i].stamp_ns - stamps[i - 1].stamp_ns);
    gaps += gap_s > kMaxImageGapSteps * step_s;
    longest_s = std::max(longest_s, gap_s);
  }
  report->AddFigure("longest step between images", longest_s, "s");
  if (gaps > 0) {
    report->Warn("image-gaps", fmt::format("{} gaps, the longest {:.3f} s", gaps, longest_s),
                 "record without loss of images (disk speed, USB bandwidth), and let nothing set "
                 "the clock forward");
  }
  if (1 / step_s < kMinImageRate_hz) {
    report->Warn("image-rate", fmt::format("{:.1f} Hz", 1 / step_s),
                 "record at 15 to 30 Hz, so that points can be followed");
  }
}

void CheckImuRate(const Rig& rig, const std::vector<ImuSample>& samples, CheckReport* report) {
  const double step_s = MedianStep_s(samples);
  report->AddFigure("IMU samples", static_cast<double>(samples.size()), "");
  if (step_s <= 0) return;
  const double rate_hz = 1 / step_s, calibrated_hz = rig.imu_noise.rate_hz;
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

void CheckCameras(const Rig& rig, CheckReport* report) {
  if (IsStereo(rig)) return;
  report->Warn("one-camera", "no right camera", "run odometry with --method points-mono");
}

// False where there is nothing to look at.
bool HasData(const SourceInfo& info, const std::vector<ImuSample>& samples, CheckReport* report) {
  if (!info.pair_stamps_ns.empty() && !samples.empty()) return true;
  report->Fail(
      "empty",
      fmt::format("{} images and {} IMU samples", info.pair_stamps_ns.size(), samples.size()),
      "record both at the same time");
  return false;
}

// What reading left out, and how much of it: "rows unreadable: 12, ...".
std::string LossWords(const Warnings& warnings) {
  std::string words;
  for (const auto& [kind, entry] : warnings.entries()) {
    words +=
        fmt::format("{}{}: {}", words.empty() ? "" : ", ", Warnings::InWords(kind), entry.count);
  }
  return words.empty() ? "nothing was left out" : words;
}

// Whether what is left is a recording at all.
void CheckLength(const SourceInfo& info, const std::vector<ImuSample>& samples,
                 const Warnings& warnings, CheckReport* report) {
  constexpr size_t kMinPairs = 10, kMinSamples = 30;
  if (info.pair_stamps_ns.size() >= kMinPairs && samples.size() >= kMinSamples) return;
  report->Fail("too-short",
               fmt::format("{} {} and {} IMU samples are left, expected at least {} and {} ({})",
                           info.pair_stamps_ns.size(), IsStereo(info.rig) ? "pairs" : "images",
                           samples.size(), kMinPairs, kMinSamples, LossWords(warnings)),
               "record for ten seconds or more, and mend what loses rows and images");
}

}  // namespace

void CheckWarnings(const Warnings& warnings, CheckReport* report) {
  for (const Remedy& remedy : kRemedies) {
    const auto found = warnings.entries().find(remedy.kind);
    if (found == warnings.entries().end()) continue;
    report->Warn(remedy.name,
                 fmt::format("{}: {}, first {}", Warnings::InWords(remedy.kind),
                             found->second.count, found->second.first_place),
                 remedy.remedy);
  }
}

void CheckStamps(const SourceInfo& info, const std::vector<ImuSample>& samples,
                 CheckReport* report) {
  CheckImageStamps(info, report);
  CheckImuRate(info.rig, samples, report);
}

void CheckCover(const SourceInfo& info, const std::vector<ImuSample>& samples,
                CheckReport* report) {
  const int64_t offset_ns = ToNanoseconds(info.rig.camera_time_offset_s);
  const std::vector<int64_t>& stamps_ns = info.pair_stamps_ns;
  const auto covered = std::count_if(stamps_ns.begin(), stamps_ns.end(), [&](int64_t stamp_ns) {
    return stamp_ns + offset_ns >= samples.front().stamp_ns &&
           stamp_ns + offset_ns <= samples.back().stamp_ns;
  });
  const double share = static_cast<double>(covered) / static_cast<double>(stamps_ns.size());
  const char* what = IsStereo(info.rig) ? "pairs" : "images";
  report->AddFigure(fmt::format("{} with IMU samples around them", what), 100 * share, "%");
  const std::string found =
      fmt::format("{} of {} {} are outside the time of the IMU samples",
                  static_cast<std::ptrdiff_t>(stamps_ns.size()) - covered, stamps_ns.size(), what);
  if (share < kMinCovered) {
    report->Fail("imu-cover", found, "record both at the same time, with stamps of one clock");
  } else if (share < 1) {
    report->Warn("imu-cover", found, "start the IMU before the cameras and stop it after them");
  }
}

CheckReport CheckSource(SequenceSource* source, const Progress& progress) {
  const SourceInfo& info = source->info();
  CheckReport report;
  report.sequence = info.name;
  report.calibration = info.calibration;
  report.cameras = info.cameras;
  CheckWarnings(source->warnings(), &report);
  CheckCameras(info.rig, &report);
  const std::vector<ImuSample> samples = AllSamples(source);
  if (!HasData(info, samples, &report)) return report;
  CheckLength(info, samples, source->warnings(), &report);
  CheckStamps(info, samples, &report);
  CheckImu(samples, &report);
  CheckCalibration(info.rig, &report);
  CheckImages(*source, progress.Part(0, 0.3), &report);
  CheckRepeats(*source, progress.Part(0.3, 0.5), &report);
  CheckCarried(source, samples, progress.Part(0.5, 0.55), &report);
  CheckGeometry(*source, samples, progress.Part(0.55, 1), &report);
  CheckCover(info, samples, &report);  // last: clocks that are apart are named by what turns
  return report;
}

CheckReport CheckStart(SequenceSource* source, const std::vector<ImuSample>& samples,
                       const Progress& progress) {
  CheckReport report;
  report.sequence = source->info().name;
  report.calibration = source->info().calibration;
  report.cameras = source->info().cameras;
  if (!HasData(source->info(), samples, &report)) return report;
  CheckReport files;  // losses are counted where images are read
  CheckFiles(*source, std::max<size_t>(1, source->info().pair_stamps_ns.size() / kStartFiles),
             progress.Part(0, 0), &files);
  if (!files.Usable()) {
    report.findings = files.findings;
    return report;
  }
  CheckImu(samples, &report);
  CheckCalibration(source->info().rig, &report);
  CheckCarried(source, samples, progress.Part(0, 0.1), &report);
  CheckGeometry(*source, samples, progress.Part(0.1, 1), &report);
  return report;
}

CheckReport CheckSequence(const std::string& path, const SequenceOptions& options,
                          const Progress& progress) {
  CheckReport report;
  std::unique_ptr<SequenceSource> source;
  try {
    Sequence sequence = OpenSequence(path, options);
    CheckReport mended;
    MendStretches(&sequence, progress.Part(0, 0), &mended);
    source = std::make_unique<AslSource>(PairsOf(std::move(sequence)));
    report = CheckSource(source.get(), progress);
    report.findings.insert(report.findings.end(), mended.findings.begin(), mended.findings.end());
    report.corrections.insert(report.corrections.end(), mended.corrections.begin(),
                              mended.corrections.end());
  } catch (const MirroredFault& fault) {
    report.Fail(fault.name(), fault.what(), fault.remedy());
    CheckMirrored(path, options, progress, &report.findings.back());
  } catch (const InputFault& fault) {
    report.Fail(fault.name(), fault.what(), fault.remedy());
  } catch (const DataError& error) {
    report.Fail("unreadable", error.what(), "write that file anew, for all to read");
  }
  report.sequence = path;
  return report;
}

}  // namespace slcmap
