#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "data/core/error.h"
#include "odometry/run/verdict.h"
#include "odometry/window/run_monitor.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr int64_t kStep_ns = 50'000'000;

// A run of 10 s at 1 m/s, as good as can be, with a pose for each image.
OdometryRun GoodRun() {
  OdometryRun run;
  run.complete = true;
  run.source.emplace();
  for (int i = 0; i < 200; ++i) {
    OnlineState state;
    state.stamp_ns = i * kStep_ns;
    state.T_world_imu.translation.x() = ToSeconds(state.stamp_ns);
    state.velocity_world_m_s.x() = 1;
    run.states.push_back(state);
    run.source->images.push_back({state.stamp_ns, "", ""});
  }
  run.figures.points_rejected = {0.01, 0.03, 190};
  run.figures.observations_rejected = {0.003, 0.01, 40};
  run.figures.reprojection_chi2 = {0.3, 0.4, 40};
  run.figures.imu_chi2 = {0.2, 0.5, 40};
  run.figures.turn_rate_rad_s = {0.001, 0.002, 190};
  run.figures.acceleration_m_s2 = {0.003, 0.01, 190};
  run.figures.seen_right = {0.8, 0.9, 40};
  return run;
}

Verdict Judged(const OdometryRun& run) { return JudgeRun(run, VerdictOptions()); }

// The level of the reason of a name; good where there is none.
VerdictLevel FindLevel(const Verdict& verdict, const std::string& what) {
  for (const VerdictReason& reason : verdict.reasons) {
    if (reason.what == what) return reason.level;
  }
  return VerdictLevel::kGood;
}

TEST(Judge, AGoodRunIsGoodWithoutReasons) {
  const Verdict verdict = Judged(GoodRun());
  EXPECT_EQ(verdict.level, VerdictLevel::kGood);
  EXPECT_TRUE(verdict.reasons.empty()) << InWords(verdict.reasons.front());
}

TEST(Judge, EachFigureIsDoubtfulAndThenFailed) {
  const VerdictOptions options;
  const std::vector<std::pair<FigureSummary RunFigures::*, VerdictLimits>> figures = {
      {&RunFigures::points_rejected, options.points_rejected},
      {&RunFigures::observations_rejected, options.observations_rejected},
      {&RunFigures::reprojection_chi2, options.reprojection_chi2},
      {&RunFigures::imu_chi2, options.imu_chi2},
      {&RunFigures::turn_rate_rad_s, options.turn_rate_rad_s},
      {&RunFigures::acceleration_m_s2, options.acceleration_m_s2}};
  for (const auto& [figure, limits] : figures) {
    OdometryRun run = GoodRun();
    (run.figures.*figure).worst = 1.01 * limits.doubtful;
    EXPECT_EQ(Judged(run).level, VerdictLevel::kDoubtful);
    (run.figures.*figure) = {1.01 * limits.doubtful, 1.01 * limits.failed, 190};
    const Verdict failed = Judged(run);
    EXPECT_EQ(failed.level, VerdictLevel::kFailed);
    ASSERT_EQ(failed.reasons.size(), 1u);
    for (const std::string& words : {failed.reasons[0].found, failed.reasons[0].expected,
                                     failed.reasons[0].remedy, failed.reasons[0].what}) {
      EXPECT_FALSE(words.empty());
    }
    (run.figures.*figure).count = 0;  // was never measured
    EXPECT_EQ(Judged(run).level, VerdictLevel::kGood);
  }
}

TEST(Judge, PointsOnWhatPassesForTwoSecondsMakeARunDoubtful) {
  OdometryRun run = GoodRun();
  run.figures.points_rejected = {0.1, 0.6, 40};
  EXPECT_EQ(Judged(run).level, VerdictLevel::kDoubtful);
}

TEST(VerdictOptions, ComeFromAFileAndGoIntoOne) {
  const testing::TempFolder folder;
  folder.Write("a.yaml",
               "verdict: {speed_m_s: {doubtful: 9, failed: 14}, max_start_s: 3}\nmethod: slc\n");
  const VerdictOptions read = VerdictOptions::FromYaml(folder.Path("a.yaml"));
  EXPECT_EQ(read.speed_m_s.doubtful, 9);
  EXPECT_EQ(read.max_start_s, 3);
  EXPECT_EQ(read.points_rejected.failed, VerdictOptions().points_rejected.failed);
  folder.Write("b.yaml", read.ToYaml());
  EXPECT_EQ(VerdictOptions::FromYaml(folder.Path("b.yaml")).speed_m_s.failed, 14);
  const auto message = [&](const std::string& text) {
    folder.Write("bad.yaml", text);
    return testing::MessageOf<ConfigError>(
        [&] { VerdictOptions::FromYaml(folder.Path("bad.yaml")); });
  };
  EXPECT_THAT(message("verdict: {sped_m_s: {doubtful: 9}}"),
              HasSubstr("verdict.sped_m_s: unknown key"));
  EXPECT_THAT(message("verdict: {speed_m_s: {doubtful: 90}}"),
              HasSubstr("verdict.speed_m_s.doubtful: found 90, expected at most failed"));
}

TEST(Judge, StatesThatCannotBeAreNamed) {
  OdometryRun fast = GoodRun(), biased = GoodRun(), jumping = GoodRun(), lost = GoodRun();
  VerdictOptions strict;
  strict.speed_m_s = {0.5, 2};
  EXPECT_EQ(FindLevel(JudgeRun(fast, strict), "speed"), VerdictLevel::kDoubtful);
  fast.states[50].velocity_world_m_s.y() = 14;
  EXPECT_EQ(FindLevel(Judged(fast), "speed"), VerdictLevel::kFailed);
  biased.states[50].accel_bias_m_s2 = Vector3d(0, 1.5, 0);
  biased.states[60].gyro_bias_rad_s = Vector3d(0, 0.45, 0);
  EXPECT_EQ(FindLevel(Judged(biased), "accelerometer-bias"), VerdictLevel::kDoubtful);
  EXPECT_EQ(FindLevel(Judged(biased), "gyroscope-bias"), VerdictLevel::kFailed);
  for (int i = 100; i < 200; ++i) jumping.states[i].T_world_imu.translation.y() += 0.5;
  EXPECT_EQ(FindLevel(Judged(jumping), "jump"), VerdictLevel::kDoubtful);
  lost.states[50].velocity_world_m_s.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(FindLevel(Judged(lost), "speed"), VerdictLevel::kFailed);
  jumping.states[50].T_world_imu.translation.z() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(FindLevel(Judged(jumping), "jump"), VerdictLevel::kFailed);
}

TEST(Judge, AKeyframeAnImageIsDoubtful) {
  OdometryRun run = GoodRun();
  run.keyframes.resize(1);
  EXPECT_EQ(FindLevel(Judged(run), "keyframes"), VerdictLevel::kDoubtful);
  run.keyframes.resize(100);
  EXPECT_EQ(Judged(run).level, VerdictLevel::kGood);
  run.keyframes.resize(190);
  EXPECT_EQ(FindLevel(Judged(run), "keyframes"), VerdictLevel::kDoubtful);
}

TEST(Judge, RightImagesThatShowNothingAreDoubtfulButForOneCamera) {
  OdometryRun run = GoodRun();
  run.figures.seen_right = {0.03, 0.1, 40};
  run.rectified_rig.cameras[1].width_px = 752;
  EXPECT_EQ(FindLevel(Judged(run), "stereo"), VerdictLevel::kDoubtful);
  run.method = "points-mono";
  EXPECT_EQ(Judged(run).level, VerdictLevel::kGood);
}

TEST(Judge, SegmentsThatEndedAreCounted) {
  OdometryRun run = GoodRun();
  for (int i = 100; i < 200; ++i) {
    run.states[i].segment = 1;
    run.states[i].T_world_imu.translation.y() += 5;  // between segments nothing is expected
  }
  run.warnings["segments ended by a gap in the images"] = 1;
  const Verdict once = Judged(run);
  EXPECT_EQ(once.level, VerdictLevel::kDoubtful);
  ASSERT_EQ(once.reasons.size(), 1u);
  EXPECT_THAT(
      InWords(once.reasons[0]),
      HasSubstr("lost: found 1 times that the estimator lost itself by a gap in the images"));
  run.warnings = {
      {"segments ended by an estimate of the calibration beyond its limit: focal length", 1}};
  EXPECT_THAT(InWords(Judged(run).reasons[0]), HasSubstr("calibrate the rig anew"));
  for (int i = 110; i < 200; ++i) run.states[i].segment = 1 + (i - 100) / 10;
  EXPECT_EQ(FindLevel(Judged(run), "lost"), VerdictLevel::kFailed);
}

TEST(Judge, ImagesWithoutAPoseAreCounted) {
  OdometryRun run = GoodRun();
  run.states.erase(run.states.begin() + 50, run.states.begin() + 80);
  EXPECT_EQ(FindLevel(Judged(run), "poses"), VerdictLevel::kDoubtful);
  run.complete = false;  // then they are not to be expected
  EXPECT_EQ(FindLevel(Judged(run), "poses"), VerdictLevel::kGood);
  run.complete = true;
  run.states.erase(run.states.begin() + 50, run.states.end() - 20);
  EXPECT_EQ(FindLevel(Judged(run), "poses"), VerdictLevel::kFailed);
}

TEST(Judge, ALateStartIsDoubtfulAndNoneAFailure) {
  OdometryRun run = GoodRun();
  for (StereoEntry& image : run.source->images) image.stamp_ns -= 20'000'000'000;
  for (const OnlineState& state : run.states)
    run.source->images.push_back({state.stamp_ns, "", ""});
  EXPECT_EQ(Judged(run).level, VerdictLevel::kDoubtful);
  EXPECT_EQ(FindLevel(Judged(run), "start"), VerdictLevel::kDoubtful);
  run.states.clear();
  EXPECT_EQ(Judged(run).level, VerdictLevel::kFailed);
  EXPECT_EQ(FindLevel(Judged(run), "start"), VerdictLevel::kFailed);
}

TEST(Judge, WhatTheCheckSaidIsAReason) {
  OdometryRun run = GoodRun();
  run.source->corrections.push_back({kTimeOffsetCorrection, {-0.02}, "time offset -20 ms"});
  EXPECT_EQ(Judged(run).level, VerdictLevel::kGood);
  EXPECT_EQ(Judged(run).reasons.size(), 1u);
  run.source->check_errors.push_back("gyro-axes: x negated");
  EXPECT_EQ(Judged(run).level, VerdictLevel::kDoubtful);
  EXPECT_EQ(Judged(run).reasons.front().what, "check");  // the worst first
}

TEST(Judge, APrincipalPointThatIsClearlyOffIsToldWithoutDoubt) {
  OdometryRun run = GoodRun();
  CalibrationEstimate& found = run.calibration.emplace_back();
  found.right_centre_px = {0.4, -0.2};
  found.right_centre_sigma_px = {0.05, 0.05};
  EXPECT_TRUE(Judged(run).reasons.empty());
  found.right_centre_px.x() = 2.2;
  const Verdict verdict = Judged(run);
  EXPECT_EQ(verdict.level, VerdictLevel::kGood);
  ASSERT_EQ(verdict.reasons.size(), 1u);
  EXPECT_EQ(verdict.reasons[0].what, "principal-point");
  found.right_centre_sigma_px.x() = 1;
  EXPECT_TRUE(Judged(run).reasons.empty());
}

TEST(Judge, ImagesThatShowNothingAreDoubtful) {
  OdometryRun run = GoodRun();
  run.figures.blind = {0.16, 1, 200};  // 1.6 s of 10 are dark
  EXPECT_EQ(FindLevel(Judged(run), "blind"), VerdictLevel::kDoubtful);
  run.figures.blind.mean = 0.09;
  EXPECT_EQ(FindLevel(Judged(run), "blind"), VerdictLevel::kGood);
}

TEST(Judge, AnAccelerometerThatSpeaksAgainstTheBaselineIsDoubtful) {
  OdometryRun run = GoodRun();
  CalibrationEstimate estimate;
  estimate.imu_errors.segment<3>(kErrorAccelScale) << 0.045, 0.03, 0.005;
  estimate.imu_errors_sigma.segment<3>(kErrorAccelScale).setConstant(0.005);
  run.calibration = {estimate};
  run.rectified_rig.cameras[1].width_px = 752;
  EXPECT_EQ(FindLevel(Judged(run), "scale"), VerdictLevel::kDoubtful);
  Verdict withdrawn = Judged(run);
  withdrawn.Withdraw("scale");
  EXPECT_EQ(withdrawn.level, VerdictLevel::kGood);
  run.calibration[0].imu_errors[kErrorAccelScale + 1] = -0.03;  // one axis is off, and another
  EXPECT_EQ(FindLevel(Judged(run), "scale"), VerdictLevel::kGood);
  run.calibration[0].imu_errors.segment<3>(kErrorAccelScale) << 0.01, 0.01, 0.03;  // one axis
  EXPECT_EQ(FindLevel(Judged(run), "scale"), VerdictLevel::kGood);
}

TEST(Judge, APartialRunIsJudgedByWhatThereIs) {
  OdometryRun run = GoodRun();
  run.complete = false;
  run.partial_reason = "interrupted";
  EXPECT_EQ(Judged(run).level, VerdictLevel::kGood);
  EXPECT_EQ(Judged(run).reasons.front().what, "partial");
  run.figures.points_rejected = {0.3, 0.9, 190};
  EXPECT_EQ(Judged(run).level, VerdictLevel::kFailed);
}

constexpr int64_t kFigureStep_ns = 100'000'000;

TEST(RunningFigure, HasAMeanAndThatOfTheWorstTwoSeconds) {
  RunningFigure figure;
  for (int i = 0; i < 200; ++i) figure.Add(i * kFigureStep_ns, i >= 100 && i < 120 ? 11 : 1);
  EXPECT_EQ(figure.Summary().count, 200);
  EXPECT_DOUBLE_EQ(figure.Summary().mean, 2);
  EXPECT_DOUBLE_EQ(figure.Summary().worst, 11);
}

TEST(RunningFigure, TheNewestSecondsCount) {
  RunningFigure figure;
  for (int i = 0; i < 25; ++i) figure.Add(i * kFigureStep_ns, i >= 20 ? 5 : 1);
  EXPECT_DOUBLE_EQ(figure.Summary().worst, 5);
}

TEST(RunningFigure, AFewValuesAreNoWorstSeconds) {
  RunningFigure figure;
  for (int i = 0; i < 20; ++i) figure.Add(i * kFigureStep_ns, 1);
  figure.Add(50 * kFigureStep_ns, 100);
  for (int i = 100; i < 120; ++i) figure.Add(i * kFigureStep_ns, 2);
  EXPECT_DOUBLE_EQ(figure.Summary().worst, 2);
}

TEST(RunningFigure, LeavesOutWhatIsNoNumber) {
  RunningFigure figure;
  figure.Add(0, 1);
  figure.Add(kFigureStep_ns, std::numeric_limits<double>::quiet_NaN());
  figure.Add(2 * kFigureStep_ns, std::numeric_limits<double>::infinity());
  EXPECT_EQ(figure.Summary().count, 1);
  EXPECT_EQ(figure.Summary().mean, 1);
}

}  // namespace
}  // namespace slcmap
