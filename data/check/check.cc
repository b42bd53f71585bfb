// Which checks run, in which order, and the small ones.
#include "data/check/check.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "data/bag/bag.h"
#include "data/calibration/calibration.h"
#include "data/check/view_geometry.h"
#include "data/core/error.h"
#include "data/core/math.h"
#include "data/io/csv.h"
#include "data/source/asl_files.h"
#include "data/source/imu_streams.h"
#include "data/source/recorded_source.h"

namespace slcmap::inline data {
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
    {kImageFewBits, "image-bits", "nothing where that is so; else write true 16 bits, or 8"},
    {kImageMosaic, "mosaic", "write grey or colour images; details are blurred a little"},
    {kImageOrientation, "orientation",
     "nothing where the cameras were calibrated with images as stored; else turn the pixels, and "
     "remove the EXIF orientation"},
    {kBagCutOff, "bag-cut-off",
     "let the recorder end before the disk is full or the power is off; what was written whole is "
     "used"},
    {kBagDamaged, "bag-damaged",
     "copy the bag again from where it was recorded; damaged parts are "
     "left out"},
    {kBagMissing, "bag-missing", "copy all files of the bag; what is missing is left out"},
    {kMessageUnreadable, "messages",
     "record the messages of these topics whole; those that cannot be read are left out"},
    {kMessageTwice, "bag-overlap",
     "nothing: its files overlap in time, and each message is taken once"},
    {kImuNoiseAssumed, "imu-noise",
     "give the IMU's noise in imu0/sensor.yaml or a Kalibr imu.yaml"},
    {kTimeShiftsDiffer, "time-shifts",
     "write one timeshift_cam_imu for both cameras, which are triggered together; that of cam0 is "
     "taken"},
};

// Adds rate, duration and gaps of the pairs.
void CheckImageStamps(const SourceInfo& info, CheckReport* report) {
  const std::vector<int64_t>& stamps_ns = info.pair_stamps_ns;
  const double step_s = MedianStep_s(stamps_ns);
  report->AddFigure(IsStereo(info.rig) ? "stereo pairs" : "images",
                    static_cast<double>(stamps_ns.size()), "");
  report->AddFigure("duration", ToSeconds(stamps_ns.back() - stamps_ns.front()), "s");
  if (step_s <= 0) return;
  report->AddFigure("image rate", 1 / step_s, "Hz");
  int gaps = 0;
  double longest_s = 0;
  for (size_t i = 1; i < stamps_ns.size(); ++i) {
    const double gap_s = ToSeconds(stamps_ns[i] - stamps_ns[i - 1]);
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
  if (HasTwoCameras(rig)) return;
  report->Warn("one-camera", "no right camera",
               "add cam1 where the rig has one; the map of one camera has no dense cloud");
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

// What reading had to drop.
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

// Counts, rates and gaps.
void CheckStamps(const SourceInfo& info, const std::vector<ImuSample>& samples,
                 CheckReport* report) {
  CheckImageStamps(info, report);
  CheckImuRate(info.rig, samples, report);
}

// Whether the samples cover the images.
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

}  // namespace

CheckReport CheckSource(SequenceSource* source, const Progress& progress) {
  const SourceInfo& info = source->info();
  CheckReport report;
  report.sequence = info.name;
  report.form = info.form;
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
    MendIntervals(&sequence, progress.Part(0, 0), &mended);
    source = std::make_unique<RecordedSource>(SelectPairs(std::move(sequence)));
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
  try {
    report.topics = ListRecordedTopics(path, options.topics);
  } catch (const DataError&) {  // of a bag that cannot be opened, as the finding says
  }
  return report;
}

namespace {

constexpr double kMinSideways = 0.8;  // of the baseline, along the left camera's x
constexpr double kMinAgreeing = 50;   // %, of the matches between left and right
constexpr double kMaxUsualBaseline_m = 1;
constexpr double kMaxAngle_rad = 20 * kDegree;  // between the optical axes

// Between the optical axes.
double AngleBetween_rad(const RigidTransform& T_left_right) {
  return std::acos(std::clamp((T_left_right.rotation * Eigen::Vector3d::UnitZ()).z(), -1.0, 1.0));
}

// The share of the baseline that points to the right of the left camera, -1 to 1.
double Sideways(const RigidTransform& T_left_right) {
  return T_left_right.translation.x() / T_left_right.translation.norm();
}

// What left and right images say outweighs where cameras usually are.
bool ImagesAgree(const CheckReport& report) {
  return std::ranges::any_of(report.figures, [](const CheckFigure& figure) {
    return figure.name == kAgreeingMatches && figure.value >= kMinAgreeing;
  });
}

// Cameras that are not side by side, the left one on the left.
void JudgeDirection(const Rig& rig, CheckReport* report) {
  const auto& poses = rig.T_imu_camera;
  const RigidTransform T_left_right = LeftRight(rig);
  const double sideways = Sideways(T_left_right);
  const double inverted = Sideways(poses[0] * poses[1].Inverse());
  const Eigen::Vector3d direction = T_left_right.translation.normalized();
  const std::string found = fmt::format(
      "the second camera is towards ({:.2f}, {:.2f}, {:.2f}) of the first, whose x is "
      "right, y down, z ahead",
      direction.x(), direction.y(), direction.z());
  if (sideways < -kMinSideways) {
    report->Fail("left-right", found, "swap cam0 and cam1, both folders and calibration");
  } else if (sideways < kMinSideways && inverted > kMinSideways) {
    report->Fail("extrinsics-direction", found,
                 "the transforms seem to be inverted: T_BS and T_imu_cam map camera to IMU, "
                 "T_cam_imu maps IMU to camera");
  } else if (sideways < kMinSideways && poses[0].rotation.isApprox(poses[1].rotation, 1e-9) &&
             poses[0].rotation.vec().norm() < 1e-9) {
    report->Fail("extrinsics-rotation", found + ", and both rotations to the IMU are the identity",
                 "write the rotations of cam0 and cam1 to the IMU (T_BS, T_imu_cam): they were "
                 "never filled in");
  } else if (sideways < kMinSideways) {
    report->Fail("baseline", found, "check the extrinsics; the cameras must be side by side");
  }
}

}  // namespace

void CheckStereoRig(const Rig& rig, CheckReport* report) {
  const RigidTransform T_left_right = LeftRight(rig);
  const double angle_rad = AngleBetween_rad(T_left_right);
  if (!ImagesAgree(*report)) JudgeDirection(rig, report);
  if (T_left_right.translation.norm() > kMaxUsualBaseline_m) {
    report->Warn("baseline",
                 fmt::format("{:.2f} m between the cameras", T_left_right.translation.norm()),
                 "check the unit of the translations (T_BS, T_cam_imu): metres are expected");
  }
  if (angle_rad > kMaxAngle_rad) {
    report->Warn("camera-angle", fmt::format("{:.1f} deg between the cameras", angle_rad / kDegree),
                 "check the extrinsics; little is seen by both cameras");
  }
}

void CheckCalibration(const Rig& rig, CheckReport* report) {
  const Camera& left = rig.cameras[0];
  if (CameraCount(rig) > 2) {  // of two it is usual
    const auto groups = CameraGroups(rig);
    report->AddFigure("cameras", CameraCount(rig), "");
    report->AddFigure("pairs among them",
                      static_cast<double>(std::ranges::count_if(groups, &CameraGroup::is_pair)),
                      "");
  }
  report->AddFigure("calibrated width", left.width_px, "px");
  report->AddFigure("calibrated height", left.height_px, "px");
  report->AddFigure("focal length", left.fx_px, "px");
  report->AddFigure("camera time offset", 1e3 * rig.camera_time_offset_s, "ms");
  if (!IsStereo(rig)) return;
  const RigidTransform T_left_right = LeftRight(rig);
  report->AddFigure("baseline", T_left_right.translation.norm(), "m");
  report->AddFigure("angle between the cameras", AngleBetween_rad(T_left_right) / kDegree, "deg");
}

namespace {

constexpr double kRepeatMaxShare = 0.5;  // of repeated images in a sequence that is of use

struct Repeats {
  int64_t count = 0;
  double longest_s = 0;
  int64_t longest_from_ns = 0;  // stamp of the image that was repeated
};

Repeats FindRepeats(const SequenceSource& source, int camera, const Progress& progress) {
  const std::vector<int64_t>& stamps_ns = source.info().pair_stamps_ns;
  Repeats repeats;
  size_t shown = 0;  // the image that those up to i repeat
  for (size_t i = 1; i < stamps_ns.size(); ++i) {
    if (i % 16 == 0) {
      progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(stamps_ns.size()));
    }
    if (!source.IsRepeated(i, camera)) {
      shown = i;
      continue;
    }
    ++repeats.count;
    const double duration_s = ToSeconds(stamps_ns[i] - stamps_ns[shown]);
    if (duration_s <= repeats.longest_s) continue;
    repeats.longest_s = duration_s;
    repeats.longest_from_ns = stamps_ns[shown];
  }
  return repeats;
}

}  // namespace

void CheckRepeats(const SequenceSource& source, const Progress& progress, CheckReport* report) {
  const SourceInfo& info = source.info();
  const int cameras = CameraCount(info.rig);
  for (int camera = 0; camera < cameras; ++camera) {
    const Repeats repeats = FindRepeats(
        source, camera, progress.Part(1.0 * camera / cameras, (camera + 1.0) / cameras));
    if (repeats.count == 0) continue;
    const std::string found = fmt::format(
        "{} of {} images of cam{} repeat the one before, the longest time {:.2f} s from stamp {}",
        repeats.count, info.pair_stamps_ns.size(), camera, repeats.longest_s,
        repeats.longest_from_ns);
    const std::string remedy =
        "check the driver: a camera that hangs repeats its last image; such images are dropped "
        "while the rig moves";
    if (static_cast<double>(repeats.count) >
        kRepeatMaxShare * static_cast<double>(info.pair_stamps_ns.size())) {
      report->Fail("frozen-camera", found, remedy);
    } else {
      report->Warn("frozen-camera", found, remedy);
    }
  }
}

namespace {

// The images of a pair of a rig of more cameras, as of a rig of their own.
class OnePair final : public SequenceSource {
 public:
  OnePair(const SequenceSource& all, int left) : all_(all), left_(left), info_(all.info()) {
    const Rig& rig = all.info().rig;
    info_.rig.Resize(2);
    info_.cameras.clear();
    for (size_t i = 0; i < 2; ++i) {
      const size_t camera = static_cast<size_t>(left) + i;
      info_.rig.cameras[i] = rig.cameras[camera];
      info_.rig.T_imu_camera[i] = rig.T_imu_camera[camera];
      info_.rig.masks[i] = rig.masks[camera];
      info_.cameras.push_back(all.info().cameras[camera]);
    }
    info_.rig.right_time_offset_s = TimeOffset_s(rig, left + 1) - TimeOffset_s(rig, left);
  }

  const SourceInfo& info() const override { return info_; }
  void SetMasks(const std::vector<cv::Mat>& masks) override { info_.rig.masks = masks; }
  std::optional<ReadPair> NextPair(int64_t) override { return std::nullopt; }
  std::optional<ImuSample> NextImu() override { return std::nullopt; }
  Warnings warnings() const override { return {}; }
  Trajectory ReadTruth() const override { return {}; }
  ImageRead ReadImage(size_t pair, int camera) const override {
    return all_.ReadImage(pair, left_ + camera);
  }
  const char* FindProblem(size_t pair, int camera) const override {
    return all_.FindProblem(pair, left_ + camera);
  }
  bool IsRepeated(size_t pair, int camera) const override {
    return all_.IsRepeated(pair, left_ + camera);
  }
  std::string ImagePlace(size_t pair, int camera) const override {
    return all_.ImagePlace(pair, left_ + camera);
  }

 private:
  const SequenceSource& all_;
  const int left_;
  SourceInfo info_;
};

// Figures and corrections are those of the first pair.
void CheckOtherPairs(const SequenceSource& source, const Progress& progress, CheckReport* report) {
  for (const auto& [left, is_pair] : CameraGroups(source.info().rig)) {
    if (left == 0 || !is_pair) continue;
    const OnePair pair(source, left);
    CheckReport of_pair;
    of_pair.cameras = pair.info().cameras;
    CheckStereo(pair, progress, &of_pair);
    for (CheckFinding finding : of_pair.findings) {
      finding.found += fmt::format(" ({} and {})", of_pair.cameras[0], of_pair.cameras[1]);
      finding.remedy += "; or name the other cameras with --cameras";
      report->findings.push_back(finding);
    }
  }
}

}  // namespace

void CheckGeometry(const SequenceSource& source, const std::vector<ImuSample>& samples,
                   const Progress& progress, CheckReport* report) {
  const Rig& rig = source.info().rig;
  if (IsStereo(rig)) {
    CheckStereo(source, progress.Part(0, 0.4), report);
    CheckOtherPairs(source, progress.Part(0.4, 0.4), report);
    // Without images that say better, what the calibration says by itself.
    if (report->Usable()) CheckStereoRig(rig, report);
  }
  // An IMU, or a calibration, that is known to be wrong explains nothing.
  if (!report->Usable()) return;
  CheckClock(source, Corrected(rig, *report), samples, progress.Part(0.4, 0.4), report);
  if (!report->Usable()) return;
  CheckMotion(source, Corrected(rig, *report), samples, progress.Part(0.4, 1), report);
}

}  // namespace slcmap::data
