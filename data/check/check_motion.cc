// Whether the images turn and move as gyroscope and accelerometer say.
// Which axes of a mirrored rotation are wrong, by the images' turns.
// Whether a gap of one table is a clock that was set forward.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "data/calibration/calibration.h"
#include "data/check/check.h"
#include "data/check/force_alignment.h"
#include "data/check/image_motion.h"
#include "data/check/turn_alignment.h"
#include "data/core/error.h"
#include "data/core/math.h"
#include "data/source/asl_files.h"
#include "data/source/recorded_source.h"

namespace slcmap::inline data {
namespace {

constexpr double kClear = 6;  // standard deviations, for a finding
constexpr double kMaxOffset_s = 0.0015, kMaxOffsetSigma_s = 0.005;
constexpr double kMaxTurned_rad = 1 * kDegree, kGrossTurned_rad = 5 * kDegree;
constexpr double kMotionMuchBetter = 0.3;  // of what is left without a change
constexpr double kMaxScaleError = 0.05, kMaxScaleSigma = 0.02;
// Good recordings come to 1 within 3 %.
constexpr double kDoubtfulBaselineError = 0.06, kMaxBaselineError = 0.2, kMaxLeverError_m = 0.3;
constexpr double kMaxLeverSigma_m = 0.2;

const char* const kCameraRemedy =
    "check T_BS (or T_imu_cam, T_cam_imu) of the cameras, the columns and signs of imu0/data.csv, "
    "and that the stamps of both are of one clock, which nothing set while it recorded";

std::string Rows(const Eigen::Matrix3d& m) {
  return fmt::format("[{:.4f}, {:.4f}, {:.4f}; {:.4f}, {:.4f}, {:.4f}; {:.4f}, {:.4f}, {:.4f}]",
                     m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1),
                     m(2, 2));
}

std::string RotationRemedy(const TurnAlignment& turns) {
  return "correct the rotation of cam0 in the calibration (T_BS, T_imu_cam; transposed in "
         "T_cam_imu), and that of cam1 alike: " +
         Rows(turns.R_imu_camera.toRotationMatrix());
}

bool Explains(const TurnFit& fit) { return fit.unexplained < kExplained; }

bool IsMuchBetter(const TurnFit& fit, const TurnFit& than) {
  return fit.unexplained < kMotionMuchBetter * than.unexplained;
}

bool SameChange(const AxisChange& a, const AxisChange& b) {
  return (a.matrix - b.matrix).cwiseAbs().maxCoeff() < 0.2;
}

// Axes of the gyroscope that do not fit the camera's.
void JudgeTurnAxes(const TurnAlignment& turns, const ForceAlignment& forces, CheckReport* report) {
  const AxisChange& change = turns.best.change;
  const std::string found = fmt::format(
      "the gyroscope explains {:.0f} % of the images' turns as calibrated, {:.0f} % with {}",
      100 * std::max(0.0, 1 - turns.claimed.unexplained), 100 * (1 - turns.best.unexplained),
      change.words == "inverted" ? "the rotation from camera to IMU inverted"
                                 : "the axes of the IMU changed: " + change.words);
  const bool accel_too = forces.enough_motion && SameChange(forces.best.change, change);
  const bool accel_right = forces.enough_motion && IsClearlyBetter(forces.claimed, forces.turned);
  if (change.IsRotation() && !accel_right) {
    if (change.words == "inverted") {
      report->Fail("extrinsics-direction", found,
                   "invert T_BS or T_cam_imu (T_BS and T_imu_cam map camera to IMU)");
    } else {
      report->Fail("imu-camera", found, RotationRemedy(turns));
    }
  } else if (accel_too) {
    report->Fail(
        "imu-axes", found + ", and so it is with the accelerometer",
        "change the columns of gyroscope and accelerometer in imu0/data.csv: " + change.words);
  } else {
    report->Fail("gyro-axes", found,
                 "change the columns of the gyroscope in imu0/data.csv: " + change.words);
  }
}

void JudgeOffset(const TurnAlignment& turns, double claimed_s, CheckReport* report) {
  report->AddFigure("time offset found", 1e3 * turns.time_offset_s, "ms");
  report->AddFigure("its standard deviation", 1e3 * turns.time_offset_sigma_s, "ms");
  const double change_s = turns.time_offset_s - claimed_s;
  if (turns.time_offset_sigma_s > kMaxOffsetSigma_s) {
    report->Note(
        "time-offset",
        fmt::format("the turns of the images tell the time offset to +- {:.1f} ms only: it "
                    "is taken as calibrated",
                    1e3 * turns.time_offset_sigma_s),
        "turn the rig to and fro about all its axes at the start of a recording");
    return;
  }
  if (std::abs(change_s) < std::max(kMaxOffset_s, kClear * turns.time_offset_sigma_s)) return;
  const std::string found = fmt::format(
      "images turn {:.1f} ms {} than the gyroscope by the calibration's offset of "
      "{:.1f} ms, {:.1f} +- {:.1f} ms fit",
      1e3 * std::abs(change_s), change_s < 0 ? "later" : "earlier", 1e3 * claimed_s,
      1e3 * turns.time_offset_s, 1e3 * turns.time_offset_sigma_s);
  const std::string remedy =
      fmt::format("write timeshift_cam_imu: {:.4f} for cam0", turns.time_offset_s);
  if (std::abs(change_s) > kMaxAlignedOffset_s) {
    report->Fail("time-offset", found, remedy + ", or bring the stamps of both to one clock");
    return;
  }
  report->Warn("time-offset", found, remedy);
  report->corrections.push_back(
      {kTimeOffsetCorrection,
       {turns.time_offset_s},
       fmt::format("time offset of the camera {:+.1f} ms", 1e3 * turns.time_offset_s)});
}

void JudgeRotation(const TurnAlignment& turns, const Rig& rig, CheckReport* report) {
  const Eigen::Vector3d turned_rad =
      LogRotation(turns.R_imu_camera * rig.T_imu_camera[0].rotation.conjugate());
  const Eigen::Vector3d& sigma_rad = turns.rotation_sigma_rad;
  double most_rad = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(turned_rad[axis]) > kClear * sigma_rad[axis]) {
      most_rad = std::max(most_rad, std::abs(turned_rad[axis]));
    }
  }
  report->AddFigure("camera to IMU, turn found", turned_rad.norm() / kDegree, "deg");
  report->AddFigure("its standard deviation, at most", sigma_rad.maxCoeff() / kDegree, "deg");
  if (most_rad < kMaxTurned_rad) return;
  const std::string found = fmt::format(
      "the camera is turned against the IMU by ({:.2f}, {:.2f}, {:.2f}) +- ({:.2f}, {:.2f}, "
      "{:.2f}) degrees about the IMU's axes more than calibrated",
      turned_rad.x() / kDegree, turned_rad.y() / kDegree, turned_rad.z() / kDegree,
      sigma_rad.x() / kDegree, sigma_rad.y() / kDegree, sigma_rad.z() / kDegree);
  if (most_rad > kGrossTurned_rad) {
    report->Fail("imu-camera", found, RotationRemedy(turns));
  } else {
    report->Warn("imu-camera", found, RotationRemedy(turns));
  }
}

void JudgeForceAxes(const ForceAlignment& forces, CheckReport* report) {
  report->Fail(
      "accel-axes",
      fmt::format("accelerations differ by {:.2f} m/s^2 from those that the images show, by {:.2f} "
                  "with the accelerometer's axes changed: {}",
                  forces.claimed.misfit_m_s2, forces.best.misfit_m_s2, forces.best.change.words),
      "change the columns of the accelerometer in imu0/data.csv: " + forces.best.change.words);
}

void JudgeBaseline(const ForceAlignment& forces, const Rig& rig, CheckReport* report) {
  const double scale = forces.image_scale, sigma = forces.image_scale_sigma;
  report->AddFigure("accelerometer over images", scale, "");
  report->AddFigure("its standard deviation", sigma, "");
  const double off = std::abs(scale - 1);
  if (off < std::max(kDoubtfulBaselineError, kClear * sigma)) return;
  const double baseline_m =
      (rig.T_imu_camera[0].translation - rig.T_imu_camera[1].translation).norm();
  const std::string found = fmt::format(
      "the accelerometer measures {:.2f} +- {:.2f} times the accelerations that the images show "
      "with a baseline of {:.4f} m",
      scale, sigma, baseline_m);
  const std::string remedy =
      fmt::format("correct the distance of cam0 and cam1 in the calibration: about {:.3f} m fit",
                  scale * baseline_m);
  if (off >= kMaxBaselineError) {
    report->Fail("baseline", found, remedy);
  } else {
    report->Warn("baseline", found,
                 remedy +
                     "; or the turn between the cameras, the focal lengths or the "
                     "accelerometer's scale");
  }
}

void JudgeLever(const ForceAlignment& forces, const Rig& rig, CheckReport* report) {
  const Eigen::Vector3d claimed_m = rig.T_imu_camera[0].translation;
  bool off = false;
  for (int axis = 0; axis < 3; ++axis) {
    const double error_m = std::abs(forces.lever_m[axis] - claimed_m[axis]);
    const double sigma_m = forces.lever_sigma_m[axis];
    off = off ||
          (sigma_m < kMaxLeverSigma_m && error_m > std::max(kMaxLeverError_m, kClear * sigma_m));
  }
  if (!off) return;
  report->Fail(
      "lever",
      fmt::format("the left camera moves as if it were at ({:.2f}, {:.2f}, {:.2f}) +- ({:.2f}, "
                  "{:.2f}, {:.2f}) m from the IMU, not at ({:.2f}, {:.2f}, {:.2f}) m",
                  forces.lever_m.x(), forces.lever_m.y(), forces.lever_m.z(),
                  forces.lever_sigma_m.x(), forces.lever_sigma_m.y(), forces.lever_sigma_m.z(),
                  claimed_m.x(), claimed_m.y(), claimed_m.z()),
      "correct the translations of T_BS (T_imu_cam, T_cam_imu), in metres");
}

void JudgeForces(const ForceAlignment& forces, const Rig& rig, CheckReport* report) {
  if (!IsStereo(rig)) return;  // one camera shows no accelerations
  if (!forces.enough_motion) {
    report->Note("accelerations",
                 "too little acceleration in the images, or none that the accelerometer explains: "
                 "its axes, the baseline and the lever are not checked",
                 "move the rig to and fro along all its axes at the start of a recording");
    return;
  }
  if (!forces.best.change.IsNone()) {  // scale and lever with other axes say nothing
    JudgeForceAxes(forces, report);
    return;
  }
  JudgeBaseline(forces, rig, report);
  JudgeLever(forces, rig, report);
}

void JudgeFarOffset(double far_s, double claimed_s, CheckReport* report) {
  const double late_s = claimed_s - far_s;
  report->Fail("time-offset",
               fmt::format("images turn {:.3f} s {} than the gyroscope by the calibration's offset "
                           "of {:.1f} ms",
                           std::abs(late_s), late_s > 0 ? "later" : "earlier", 1e3 * claimed_s),
               fmt::format("bring the stamps of both to one clock: add {:.3f} s to those of cam0 "
                           "and cam1",
                           -late_s));
}

void Judge(const TurnAlignment& turns, const ForceAlignment& forces, const Rig& rig,
           CheckReport* report) {
  if (!turns.enough_motion) {
    report->Note("alignment", "too little turning in the images to compare them with the gyroscope",
                 "turn the rig about all its axes at the start of a recording");
    return;
  }
  report->AddFigure("turn rate of the images, RMS", turns.turn_rate_rad_s, "rad/s");
  report->AddFigure("unexplained by the gyroscope", 100 * turns.best.unexplained, "%");
  if (!turns.best.change.IsNone() && Explains(turns.best) &&
      IsMuchBetter(turns.best, turns.claimed)) {
    JudgeTurnAxes(turns, forces, report);
  } else if (!Explains(turns.best) &&
             turns.unexplained < kMotionMuchBetter * turns.best.unexplained) {
    report->Fail("imu-camera",
                 fmt::format("the gyroscope explains {:.0f} % of the images' turns as calibrated, "
                             "and more with another rotation",
                             100 * std::max(0.0, 1 - turns.claimed.unexplained)),
                 kCameraRemedy);
  } else if (turns.best.unexplained > 0.5) {
    report->Fail("imu-camera",
                 fmt::format("the gyroscope explains {:.0f} % of the images' turns at best, with "
                             "any axes and time offset",
                             100 * std::max(0.0, 1 - turns.best.unexplained)),
                 kCameraRemedy);
  } else {
    if (!JudgeScales(turns, rig, report)) return;
    JudgeOffset(turns, rig.camera_time_offset_s, report);
    JudgeRotation(turns, rig, report);
    JudgeForces(forces, rig, report);
  }
}

// Whether the images tell anything of all that is compared.
bool Tells(const TurnAlignment& turns, const ForceAlignment& forces, const Rig& rig) {
  return turns.enough_motion && (forces.enough_motion || !IsStereo(rig));
}

}  // namespace

bool JudgeScales(const TurnAlignment& turns, const Rig& rig, CheckReport* report) {
  const Eigen::Vector3d& scales = turns.scales;
  const auto off = [&](int axis) {
    return std::abs(scales[axis] - 1) > std::max(kMaxScaleError, kClear * turns.scale_sigmas[axis]);
  };
  if (!off(0) && !off(1)) return true;
  const bool rolls = turns.scale_sigmas.z() < kMaxScaleSigma;
  const std::string found = fmt::format(
      "images turn ({:.3f}, {:.3f}, {:.3f}) times as much about the camera's x, y, z as the "
      "gyroscope says",
      scales.x(), scales.y(), scales.z());
  const std::string gyro =
      scales.y() > 0.01 && scales.y() < 0.03
          ? std::string("the gyroscope seems to be in deg/s: multiply by pi / 180")
          : fmt::format("multiply the gyroscope's readings by {:.3f}", scales.y());
  const std::string focal = fmt::format(
      "calibrate the cameras for images of this size: the focal lengths seem to be {:.0f} and "
      "{:.0f} px",
      rig.cameras[0].fx_px * scales.y(), rig.cameras[0].fy_px * scales.x());
  const bool all = std::abs(scales.z() / scales.y() - 1) < kMaxScaleError &&
                   (std::abs(scales.x() / scales.y() - 1) < kMaxScaleError ||
                    turns.scale_sigmas.x() >= kMaxScaleSigma);
  if (rolls && all) {
    report->Fail(scales.y() < 0.03 ? "imu-units" : "gyro-scale", found, gyro);
  } else if (rolls) {
    report->Fail("focal-length", found, focal);
  } else if (IsStereo(rig) || std::abs(scales.x() / scales.y() - 1) < kMaxScaleError) {
    report->Fail("turn-scale", found, gyro + ", or " + focal);
  } else {
    report->Warn("turn-scale", found, "record a place with more texture; one camera does not tell");
    return false;
  }
  return true;
}

void CheckMotion(const SequenceSource& source, const Rig& rig,
                 const std::vector<ImuSample>& samples, const Progress& progress,
                 CheckReport* report) {
  ImageMotion motion =
      FollowImages(source, rig, LiveliestParts(source.info(), samples, kLookedAt_s), progress);
  const RigidTransform& T_imu_camera = rig.T_imu_camera[0];
  TurnAlignment turns;
  ForceAlignment forces;
  const auto align = [&] {
    turns = AlignTurns(motion.turns, samples, T_imu_camera.rotation, rig.camera_time_offset_s);
    forces = AlignForces(motion.steps, samples, turns, T_imu_camera);
  };
  align();
  // Where the rig moves most it may look at what shows nothing, as a dark ceiling.
  if (!Tells(turns, forces, rig)) {
    const auto further = LiveliestParts(source.info(), samples, kLookedAt_s, kLookedAt_s);
    Append(FollowImages(source, rig, further, progress.Part(1, 1)), &motion);
    align();
  }
  const std::optional<double> far_s =
      turns.enough_motion && Explains(turns.best)
          ? std::nullopt
          : FindFarOffset(motion.turns, samples, T_imu_camera.rotation, rig.camera_time_offset_s);
  if (far_s) {
    const TurnAlignment far = AlignTurns(motion.turns, samples, T_imu_camera.rotation, *far_s);
    JudgeFarOffset(far.enough_motion ? far.time_offset_s : *far_s, rig.camera_time_offset_s,
                   report);
    return;
  }
  Judge(turns, forces, rig, report);
}

namespace {

// In words, such as "x negated"; "" where the turns do not tell.
std::string MirroredAxes(const TurnAlignment& turns) {
  if (!turns.enough_motion || turns.best.unexplained > kExplained) return "";
  if (turns.best.change.IsNone()) return "";  // of the left camera, which is right
  // With all axes negated it is a rotation, and its axes are changed by -mirror.
  const Eigen::Matrix3d mirror = -turns.best.change.matrix;
  const auto& changes = AxisChanges();
  const auto found = std::find_if(changes.begin(), changes.end(), [&](const AxisChange& change) {
    return (change.matrix - mirror).cwiseAbs().maxCoeff() < 0.5;
  });
  return found == changes.end() ? "" : found->words;
}

}  // namespace

void CheckMirrored(const std::string& path, SequenceOptions options, const Progress& progress,
                   CheckFinding* finding) {
  options.mirrored = Mirrored::kNegated;
  try {
    const auto source = OpenSource(path, options);
    const std::vector<ImuSample> samples = AllSamples(source.get());
    Rig rig = source->info().rig;
    rig.Resize(1);  // where it is against the left one is not known
    const auto parts = LiveliestParts(source->info(), samples, kLookedAt_s);
    const std::string words =
        MirroredAxes(AlignTurns(FollowImages(*source, rig, parts, progress).turns, samples,
                                rig.T_imu_camera[0].rotation, rig.camera_time_offset_s));
    if (words.empty()) return;
    finding->found +=
        fmt::format("; by the images' turns it has the IMU's axes changed: {}", words);
    finding->remedy += fmt::format(
        ", or change the rows of the rotation of T_BS or T_imu_cam (columns of T_cam_imu) back: {}",
        words);
  } catch (const DataError&) {
    // What else is wrong with the recording is told once this is mended.
  }
}

namespace {

constexpr double kClockGap_s = 0.08;    // beyond a usual step, at least
constexpr double kClockBeside_s = 0.2;  // of a gap in the other table that may be the same
constexpr double kClockLook_s = 4;      // on either side of a gap
constexpr size_t kClockGaps = 2;        // that are looked at, the longest

// Between two stamps, on the IMU's clock.
struct TableGap {
  int64_t from_ns, to_ns;
  double beyond_s;  // a usual step
};

std::vector<TableGap> FindGaps(const std::vector<int64_t>& stamps_ns) {
  const double usual_s = MedianStep_s(stamps_ns);
  std::vector<TableGap> gaps;
  for (size_t i = 1; i < stamps_ns.size(); ++i) {
    const double beyond_s = ToSeconds(stamps_ns[i] - stamps_ns[i - 1]) - usual_s;
    if (beyond_s < std::max(kClockGap_s, usual_s)) continue;
    gaps.push_back({stamps_ns[i - 1], stamps_ns[i], beyond_s});
  }
  return gaps;
}

// The longest of the gaps that others do not share.
std::vector<TableGap> GapsAlone(std::vector<TableGap> gaps, const std::vector<TableGap>& others) {
  const int64_t beside_ns = ToNanoseconds(kClockBeside_s);
  std::erase_if(gaps, [&](const TableGap& gap) {
    return std::ranges::any_of(others, [&](const TableGap& other) {
      return other.from_ns < gap.to_ns + beside_ns && other.to_ns > gap.from_ns - beside_ns;
    });
  });
  std::ranges::stable_sort(gaps, std::ranges::greater(), &TableGap::beyond_s);
  gaps.resize(std::min(gaps.size(), kClockGaps));
  return gaps;
}

class ClockJudge {
 public:
  ClockJudge(const SequenceSource& source, const Rig& rig, const std::vector<ImuSample>& samples,
             const Progress& progress)
      : source_(source), rig_(rig), samples_(samples), progress_(progress) {
    const int64_t offset_ns = ToNanoseconds(rig.camera_time_offset_s);
    for (const int64_t stamp_ns : source.info().pair_stamps_ns) {
      image_stamps_ns_.push_back(stamp_ns + offset_ns);
    }
  }

  void Judge(CheckReport* report) const {
    std::vector<int64_t> sample_stamps_ns;
    for (const ImuSample& sample : samples_) sample_stamps_ns.push_back(sample.stamp_ns);
    const std::vector<TableGap> images = FindGaps(image_stamps_ns_),
                                imu = FindGaps(sample_stamps_ns);
    for (const TableGap& gap : GapsAlone(images, imu)) JudgeGap(gap, true, report);
    for (const TableGap& gap : GapsAlone(imu, images)) JudgeGap(gap, false, report);
  }

 private:
  // About the offset that is expected.
  TurnAlignment Align(const std::vector<ImageTurn>& turns, double offset_s) const {
    return AlignTurns(turns, samples_, rig_.T_imu_camera[0].rotation, offset_s);
  }

  // Of the images in [from_ns, to_ns).
  std::vector<ImageTurn> TurnsBetween(int64_t from_ns, int64_t to_ns) const {
    const auto index = [&](int64_t stamp_ns) {
      return static_cast<size_t>(std::ranges::lower_bound(image_stamps_ns_, stamp_ns) -
                                 image_stamps_ns_.begin());
    };
    return FollowImages(source_, rig_, {{index(from_ns), index(to_ns)}}, progress_).turns;
  }

  // Where the clock was set the offset of what is behind is another, by the gap; else it stays.
  void JudgeGap(const TableGap& gap, bool of_images, CheckReport* report) const {
    const int64_t look_ns = ToNanoseconds(kClockLook_s);
    const TurnAlignment before =
        Align(TurnsBetween(gap.from_ns - look_ns, gap.from_ns + 1), rig_.camera_time_offset_s);
    if (!before.enough_motion || before.claimed.unexplained >= kExplained) return;
    const auto behind = TurnsBetween(gap.to_ns, gap.to_ns + look_ns);
    const auto fits = [&](const TurnAlignment& turns, double offset_s) {
      return turns.enough_motion && turns.claimed.unexplained < kExplained &&
             std::abs(turns.time_offset_s - offset_s) < 0.25 * gap.beyond_s;
    };
    const double before_s = before.time_offset_s;
    const double set_s = before_s + (of_images ? -gap.beyond_s : gap.beyond_s);
    if (fits(Align(behind, before_s), before_s)) return;
    const TurnAlignment set = Align(behind, set_s);
    if (!fits(set, set_s)) return;
    // A row that was lost there makes the gap longer.
    const double turned_s = std::abs(set.time_offset_s - before_s);
    const double by_s = std::abs(turned_s - gap.beyond_s) < 0.01 ? gap.beyond_s : turned_s;
    const int64_t by_ns = 100'000 * std::llround(1e4 * by_s);  // steps are not that even
    const int64_t offset_ns = of_images ? ToNanoseconds(rig_.camera_time_offset_s) : 0;
    const int64_t last_ns = gap.from_ns - offset_ns;
    const int64_t within_ns =
        last_ns + (gap.to_ns - gap.from_ns) / 2;  // stamps of a pair may differ
    const char* of_cameras = IsStereo(rig_) ? "cam0/data.csv and cam1/data.csv" : "cam0/data.csv";
    const char* tables = of_images ? of_cameras : "imu0/data.csv";
    report->Fail(
        "clock",
        report->Named(fmt::format(
            "the clock of {} was set forward by {:.3f} s: there is a gap of {:.3f} s after stamp "
            "{} that the {} have not, and behind it images turn {:.3f} s {} against the gyroscope "
            "than before",
            tables, by_s, ToSeconds(gap.to_ns - gap.from_ns), last_ns,
            of_images ? "IMU samples" : "images", turned_s, of_images ? "later" : "earlier")),
        fmt::format("let nothing set the recorder's clock while it records (NTP); of this "
                    "recording, take {} from the stamps of {} after {}",
                    by_ns, tables, within_ns));
  }

  const SequenceSource& source_;
  const Rig& rig_;
  const std::vector<ImuSample>& samples_;
  const Progress progress_;
  std::vector<int64_t> image_stamps_ns_;
};

}  // namespace

void CheckClock(const SequenceSource& source, const Rig& rig, const std::vector<ImuSample>& samples,
                const Progress& progress, CheckReport* report) {
  ClockJudge(source, rig, samples, progress).Judge(report);
}

}  // namespace slcmap::data
