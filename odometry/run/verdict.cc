#include "odometry/run/verdict.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <utility>

#include "data/io/yaml.h"
#include "odometry/run/run.h"

namespace slcmap::inline odometry {

constexpr OptionTable kVerdictLimits{Option{"doubtful", &VerdictLimits::doubtful, 0.0, 1e12},
                                     Option{"failed", &VerdictLimits::failed, 0.0, 1e12}};

void VerdictLimits::Check(const std::string& key) const {
  kVerdictLimits.Check("verdict." + key, *this);
  CheckOrder("verdict." + key, "doubtful", doubtful, "failed", failed);
}
void VerdictLimits::Read(YamlSection section) { kVerdictLimits.Read(section, this); }

namespace {

constexpr double kMinSeenRight = 0.25;  // of a keyframe's points; fewer are doubtful
constexpr double kFailedRestartsAMinute = 6;
constexpr double kMinPosedShare = 0.9;  // of the images from the first pose on; less is doubtful
constexpr double kFailedPosedShare = 0.5;

constexpr std::pair<const char*, VerdictLimits VerdictOptions::*> kVerdictSections[] = {
    {"points_rejected", &VerdictOptions::points_rejected},
    {"observations_rejected", &VerdictOptions::observations_rejected},
    {"reprojection_chi2", &VerdictOptions::reprojection_chi2},
    {"imu_chi2", &VerdictOptions::imu_chi2},
    {"turn_rate_rad_s", &VerdictOptions::turn_rate_rad_s},
    {"acceleration_m_s2", &VerdictOptions::acceleration_m_s2},
    {"speed_m_s", &VerdictOptions::speed_m_s},
    {"gyro_bias_rad_s", &VerdictOptions::gyro_bias_rad_s},
    {"accel_bias_m_s2", &VerdictOptions::accel_bias_m_s2},
    {"jump_m", &VerdictOptions::jump_m},
    {"keyframe_rate_hz", &VerdictOptions::keyframe_rate_hz}};

}  // namespace

constexpr OptionTable kVerdict{Option{"max_start_s", &VerdictOptions::max_start_s, 0.0, 1e9}};

void VerdictOptions::Check() const {
  kVerdict.Check("verdict", *this);
  for (const auto& [key, limits] : kVerdictSections) (this->*limits).Check(key);
}
void VerdictOptions::Read(YamlSection section) {
  for (const auto& [key, limits] : kVerdictSections) (this->*limits).Read(section.Section(key));
  kVerdict.Read(
      section, this,
      {"min_seen_right", "failed_restarts_a_minute", "min_posed_share", "failed_posed_share"});
}

VerdictOptions VerdictOptions::FromYaml(const std::string& path) {
  return ReadConfigFile(path, ConfigOrigin::kUser, [](YamlSection& root) {
    VerdictOptions options;
    options.Read(root.Section("verdict"));
    options.Check();
    return options;
  });
}

std::string VerdictOptions::ToYaml() const {
  VerdictOptions options = *this;
  return YamlSection::Dump([&](YamlSection* root) { options.Read(root->Section("verdict")); });
}

namespace {

const char* const kCheckRemedy =
    "let slcmap check name what is wrong with calibration, stamps or IMU, and correct it";

constexpr double kMinDuration_s = 3;  // of a run, to speak of a rate

// A figure that is good while it is low.
struct JudgedFigure {
  const char* what;
  FigureSummary RunFigures::*figure;
  VerdictLimits VerdictOptions::*limits;
  const char* unit;   // of what is told
  double unit_scale;  // of that to the figure's
  const char* words;  // what the number is of
  const char* remedy;
  bool fails_by_mean = false;  // two bad seconds alone do not fail a run
};

const JudgedFigure kFigures[] = {
    {"points-rejected", &RunFigures::points_rejected, &VerdictOptions::points_rejected, " %", 100,
     "of the points followed far from where the motion has them",
     "let slcmap check name what is wrong with calibration, stamps or IMU, and correct it; of a "
     "rolling shutter, let --config set calibration: {readout: true}; or most of what the cameras "
     "see moves itself",
     true},
    {"observations-rejected", &RunFigures::observations_rejected,
     &VerdictOptions::observations_rejected, " %", 100,
     "of the observations of points do not fit the motion and their place", kCheckRemedy},
    {"reprojection-misfit", &RunFigures::reprojection_chi2, &VerdictOptions::reprojection_chi2, "",
     1, "as squared residual of the points in the images, by its variance", kCheckRemedy},
    {"imu-misfit", &RunFigures::imu_chi2, &VerdictOptions::imu_chi2, "", 1,
     "as squared residual of the IMU between keyframes, by its variance",
     "let slcmap check name what is wrong with IMU, stamps and baseline; or give the IMU's true "
     "noise in its calibration"},
    {"turn-misfit", &RunFigures::turn_rate_rad_s, &VerdictOptions::turn_rate_rad_s, " rad/s", 1,
     "between the turns of images and gyroscope", kCheckRemedy},
    {"acceleration-misfit", &RunFigures::acceleration_m_s2, &VerdictOptions::acceleration_m_s2,
     " m/s^2", 1, "between the accelerations of images and accelerometer", kCheckRemedy}};

// The level of a value that is good while it is low.
VerdictLevel FindLevel(double value, const VerdictLimits& limits) {
  if (!(value <= limits.failed)) return VerdictLevel::kFailed;
  return value > limits.doubtful ? VerdictLevel::kDoubtful : VerdictLevel::kGood;
}

void JudgeFigure(const JudgedFigure& judged, const RunFigures& figures,
                 const VerdictOptions& options, Verdict* verdict) {
  const FigureSummary& figure = figures.*judged.figure;
  const VerdictLimits& limits = options.*judged.limits;
  if (figure.count == 0) return;
  VerdictLevel level = FindLevel(figure.worst, limits);
  if (level == VerdictLevel::kGood) return;
  // Somebody who walks past fills two seconds with points that are rightly rejected. Most faults of
  // a rig do so all along.
  const bool is_short = std::isfinite(figure.worst) && figure.mean <= limits.doubtful;
  if (judged.fails_by_mean && is_short) level = VerdictLevel::kDoubtful;
  const auto told = [&](double value) {
    return fmt::format("{:.3g}{}", judged.unit_scale * value, judged.unit);
  };
  verdict->Add({level, judged.what,
                fmt::format("{} {} ({} over the worst two seconds)", told(figure.mean),
                            judged.words, told(figure.worst)),
                "at most " + told(limits.doubtful), judged.remedy});
}

// The largest size along the run of what is judged of a state; no number where one is none.
template <typename GetSize>
double FindLargest(const std::vector<OnlineState>& states, GetSize size_of) {
  double largest = 0;
  for (const OnlineState& state : states) {
    const double size = size_of(state);
    if (std::isnan(size)) return size;
    largest = std::max(largest, size);
  }
  return largest;
}

void JudgeSize(const char* what, double found, const VerdictLimits& limits, const char* unit,
               const std::string& words, const std::string& remedy, Verdict* verdict) {
  const VerdictLevel level = FindLevel(found, limits);
  if (level == VerdictLevel::kGood) return;
  verdict->Add({level, what, fmt::format("{} of {:.3g} {}", words, found, unit),
                fmt::format("at most {:.3g} {}", limits.doubtful, unit), remedy});
}

// The largest difference of a step between images from what the velocities at its ends say; no
// number where one is none.
double LargestJump_m(const std::vector<OnlineState>& states) {
  constexpr double kMaxStep_s = 0.2;
  double largest_m = 0;
  for (size_t i = 1; i < states.size(); ++i) {
    const OnlineState &from = states[i - 1], &to = states[i];
    const double step_s = ToSeconds(to.stamp_ns - from.stamp_ns);
    if (from.segment != to.segment || step_s > kMaxStep_s) continue;
    const Eigen::Vector3d expected_m =
        0.5 * step_s * (from.velocity_world_m_s + to.velocity_world_m_s);
    const double jump_m =
        (to.T_world_imu.translation - from.T_world_imu.translation - expected_m).norm();
    if (std::isnan(jump_m)) return jump_m;
    largest_m = std::max(largest_m, jump_m);
  }
  return largest_m;
}

void JudgeStates(const OdometryRun& run, const VerdictOptions& options, Verdict* verdict) {
  const std::string calibrate = kCheckRemedy;
  JudgeSize("speed",
            FindLargest(run.states, [](const auto& s) { return s.velocity_world_m_s.norm(); }),
            options.speed_m_s, "m/s", "a speed",
            calibrate + "; raise verdict.speed_m_s where the rig is that fast", verdict);
  JudgeSize("gyroscope-bias",
            FindLargest(run.states, [](const auto& s) { return s.gyro_bias_rad_s.norm(); }),
            options.gyro_bias_rad_s, "rad/s", "a bias", calibrate, verdict);
  JudgeSize("accelerometer-bias",
            FindLargest(run.states, [](const auto& s) { return s.accel_bias_m_s2.norm(); }),
            options.accel_bias_m_s2, "m/s^2", "a bias", calibrate, verdict);
  JudgeSize("jump", LargestJump_m(run.states), options.jump_m, "m",
            "a step from one image to the next besides its speed", calibrate, verdict);
}

// Keyframes as fast as images come: nothing is known for long. A single one: nothing is judged.
void JudgeKeyframes(const OdometryRun& run, const VerdictOptions& options, Verdict* verdict) {
  if (run.keyframes.size() == 1) {
    verdict->Add({VerdictLevel::kDoubtful, "keyframes",
                  "a single one, so that no motion was measured", "two at least",
                  "record for longer, and move the rig"});
  }
  const double duration_s = ToSeconds(run.states.back().stamp_ns - run.states.front().stamp_ns);
  if (duration_s < kMinDuration_s) return;
  JudgeSize("keyframes", static_cast<double>(run.keyframes.size()) / duration_s,
            options.keyframe_rate_hz, "a second", "a rate of keyframes", kCheckRemedy, verdict);
}

bool UsesPair(const OdometryRun& run) {
  return run.method != MethodName(Method::kPointsMono) && IsStereo(run.rectified_rig);
}

void JudgeStereo(const OdometryRun& run, Verdict* verdict) {
  const FigureSummary& seen = run.figures.seen_right;
  if (seen.count == 0 || !UsesPair(run)) return;
  if (seen.mean >= kMinSeenRight) return;
  verdict->Add({VerdictLevel::kDoubtful, "stereo",
                fmt::format("{:.0f} % of the points in the right images", 100 * seen.mean),
                fmt::format("at least {:.0f} %", 100 * kMinSeenRight),
                std::string(kCheckRemedy) +
                    "; the right camera may be turned, swapped, out of step or covered"});
}

// Times at which the estimator lost itself.
int SegmentEnds(const std::vector<OnlineState>& states) {
  return states.empty() ? 0 : states.back().segment - states.front().segment;
}

void JudgeSegments(const OdometryRun& run, Verdict* verdict) {
  const int ends = SegmentEnds(run.states);
  if (ends == 0) return;
  const double minutes = ToSeconds(run.states.back().stamp_ns - run.states.front().stamp_ns) / 60;
  const bool often = ends > kFailedRestartsAMinute * std::max(minutes, 0.5);
  std::string reasons,
      remedy = "record without gaps, with light and texture in view; where that is so, ";
  for (const auto& [kind, count] : run.warnings) {
    if (kind.starts_with("segments ended by ")) {
      if (kind.find("calibration beyond its limit") != std::string::npos) {
        remedy = "calibrate the rig anew, as it is further off than can be estimated; " + remedy;
      }
      reasons += fmt::format("{}{} ({})", reasons.empty() ? " by " : ", ",
                             kind.substr(std::string("segments ended by ").size()), count);
    }
  }
  verdict->Add({often ? VerdictLevel::kFailed : VerdictLevel::kDoubtful, kLostReason,
                fmt::format("{} times that the estimator lost itself{}", ends, reasons),
                "none: what is behind each is shifted by what moved meanwhile",
                remedy + kCheckRemedy});
}

// Images of the recording, from the first pose on, that have none.
void JudgeCover(const OdometryRun& run, const VerdictOptions& options, Verdict* verdict) {
  if (!run.source || run.source->images.empty() || !run.complete) return;
  const std::vector<StereoEntry>& images = run.source->images;
  const int64_t first_ns = run.states.front().stamp_ns;
  const auto since = std::count_if(images.begin(), images.end(), [&](const StereoEntry& image) {
    return image.stamp_ns >= first_ns;
  });
  const double share = static_cast<double>(run.states.size()) / static_cast<double>(since);
  if (!run.timings.real_time && share < kMinPosedShare) {
    verdict->Add({share < kFailedPosedShare ? VerdictLevel::kFailed : VerdictLevel::kDoubtful,
                  "poses", fmt::format("a pose for {:.0f} % of the images", 100 * share),
                  fmt::format("at least {:.0f} %", 100 * kMinPosedShare),
                  "record without gaps, with light and texture in view"});
  }
  const double wait_s = ToSeconds(first_ns - images.front().stamp_ns);
  if (wait_s > options.max_start_s) {
    verdict->Add({VerdictLevel::kDoubtful, "start",
                  fmt::format("the first pose {:.1f} s after the first image", wait_s),
                  fmt::format("at most {:.1f} s", options.max_start_s),
                  "start at rest, or with slow motion before things that are near"});
  }
}

// Images that show none of the points that are followed: little but the IMU tells their poses.
void JudgeBlindness(const OdometryRun& run, Verdict* verdict) {
  constexpr double kMost_s = 1, kMostShare = 0.01;
  const double duration_s = ToSeconds(run.states.back().stamp_ns - run.states.front().stamp_ns);
  const FigureSummary& blind = run.figures.blind;
  const double images = static_cast<double>(run.figures.turn_rate_rad_s.count);
  const double blind_s =
      blind.mean * static_cast<double>(blind.count) / std::max(images, 1.0) * duration_s;
  const double most_s = std::max(kMost_s, kMostShare * duration_s);
  if (blind_s <= most_s) return;
  verdict->Add({VerdictLevel::kDoubtful, "blind",
                fmt::format("{:.1f} s of images that show none of the points that are followed, so "
                            "that little but the IMU tells their poses",
                            blind_s),
                fmt::format("at most {:.1f} s", most_s),
                "keep the cameras uncovered, with light and texture in view"});
}

// What the check before the start said.
void JudgeSource(const OdometryRun& run, Verdict* verdict) {
  if (!run.source) return;
  for (const std::string& error : run.source->check_errors) {
    verdict->Add({VerdictLevel::kDoubtful, "check", error, "a recording without errors",
                  "correct it, and run again without --force"});
  }
  for (const CheckCorrection& correction : run.source->corrections) {
    verdict->Add({VerdictLevel::kGood, "corrected", correction.words, "what is calibrated",
                  "correct the calibration: --write-calibration writes all that was found in the "
                  "end, which may take this back"});
  }
}

// Metres are those of the distance between the cameras. Where it is wrong, only the accelerometer
// speaks against it, and seems to have another scale along all axes that it was moved along, alike.
void JudgeScale(const OdometryRun& run, Verdict* verdict) {
  constexpr double kClear = 5, kMost = 0.025;
  if (run.calibration.empty() || !UsesPair(run)) return;
  const CalibrationEstimate& e = run.calibration.back();
  const Eigen::Vector3d scales = e.imu_errors.segment<3>(kErrorAccelScale);
  std::array<int, 3> axes = {0, 1, 2};
  std::ranges::sort(axes, std::greater(), [&](int axis) { return std::abs(scales[axis]); });
  const double mean = 0.5 * (scales[axes[0]] + scales[axes[1]]);
  const double sigma = 0.5 * std::hypot(e.imu_errors_sigma[kErrorAccelScale + axes[0]],
                                        e.imu_errors_sigma[kErrorAccelScale + axes[1]]);
  const bool are_alike = scales[axes[0]] * scales[axes[1]] > 0;
  if (!are_alike || std::abs(mean) < std::max(kMost, kClear * sigma)) return;
  verdict->Add(
      {VerdictLevel::kDoubtful, kScaleReason,
       fmt::format("an accelerometer that measures {:.1f} % too {} for the motion in the images",
                   100 * std::abs(mean), mean > 0 ? "little" : "much"),
       fmt::format("at most {:.1f} %", 100 * kMost),
       "measure the distance between the cameras, which all metres come from; or correct the "
       "accelerometer's scale; slcmap map --distance scales by what was measured"});
}

// What of the calibration is so far off that other recordings of the rig suffer, too.
void JudgeCentre(const OdometryRun& run, Verdict* verdict) {
  constexpr double kClear = 5, kMost_px = 1;
  if (run.calibration.empty()) return;
  const CalibrationEstimate& e = run.calibration.back();
  for (int axis = 0; axis < 2; ++axis) {
    const double off_px = std::abs(e.right_centre_px[axis]);
    if (off_px < std::max(kMost_px, kClear * e.right_centre_sigma_px[axis])) continue;
    verdict->Add({VerdictLevel::kGood, "principal-point",
                  fmt::format("the right camera's principal point ({:.1f}, {:.1f}) px off against "
                              "the left one's",
                              e.right_centre_px.x(), e.right_centre_px.y()),
                  fmt::format("at most {} px", kMost_px),
                  "calibrate the cameras anew, or take what --write-calibration writes"});
    return;
  }
}

}  // namespace

Verdict JudgeRun(const OdometryRun& run, const VerdictOptions& options) {
  Verdict verdict;
  JudgeSource(run, &verdict);
  JudgeCentre(run, &verdict);
  if (!run.complete) {
    verdict.Add({VerdictLevel::kGood, "partial", run.partial_reason, "the whole recording",
                 "run it again"});
  }
  if (run.states.empty()) {
    verdict.Add({VerdictLevel::kFailed, "start", "no motion that could be estimated",
                 "at least one pose", kCheckRemedy});
    return verdict;
  }
  for (const JudgedFigure& figure : kFigures) JudgeFigure(figure, run.figures, options, &verdict);
  JudgeStates(run, options, &verdict);
  JudgeKeyframes(run, options, &verdict);
  JudgeStereo(run, &verdict);
  JudgeSegments(run, &verdict);
  JudgeCover(run, options, &verdict);
  JudgeBlindness(run, &verdict);
  JudgeScale(run, &verdict);
  return verdict;
}

}  // namespace slcmap::odometry
