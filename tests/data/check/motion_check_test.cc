// What the check looks at of a recording that shows little where it moves most.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "data/calibration/calibration.h"
#include "data/check/check.h"
#include "data/check/image_motion.h"
#include "data/check/step_lags.h"
#include "data/check/turn_alignment.h"
#include "data/simulator/motion.h"
#include "tests/testing/box_room_renderer.h"
#include "tests/testing/example.h"
#include "tests/testing/memory_source.h"
#include "tests/testing/pinhole_camera.h"

namespace slcmap {
namespace {

constexpr double kDuration_s = 24, kRate_hz = 12;

// A recording in a room whose liveliest `dark_s` are dark.
testing::MemorySource PartlyDark(double dark_s) {
  RenderTask task{SmallRig(), ExampleFlight(SmallRig(), kDuration_s, 0), {}};
  SourceInfo info;
  std::vector<StereoImage> pairs;
  const cv::Mat dark(192, 300, CV_8UC1, cv::Scalar(0));
  for (double t_s = 0.1; t_s < kDuration_s - 0.1; t_s += 1 / kRate_hz) {
    task.times_s.push_back(t_s);
    info.pair_stamps_ns.push_back(ToNanoseconds(t_s));
    pairs.push_back({ToNanoseconds(t_s), dark, dark});
  }
  const std::vector<ImuSample> imu = SimulateImu(task.motion, {}).samples;
  BoxRoomRenderer renderer(task, 2.5);
  for (const IndexRange& part : LiveliestParts(info, imu, kDuration_s - dark_s, dark_s)) {
    for (size_t i = part.first; i < part.end; ++i) {
      const RenderedPair pair = renderer.Render(static_cast<int>(i), false);
      pairs[i].left = pair.left;
      pairs[i].right = pair.right;
    }
  }
  return {task.rig, std::move(pairs), imu};
}

std::string Findings(double dark_s) {
  const testing::MemorySource source = PartlyDark(dark_s);
  testing::MemorySource imu = source;
  CheckReport report;
  CheckMotion(source, source.info().rig, AllSamples(&imu), Progress(), &report);
  std::string names;
  for (const CheckFinding& finding : report.findings) names += finding.name + " ";
  return names;
}

TEST(CheckMotion, LooksFurtherWhereTheLiveliestPartsShowNothing) {
  EXPECT_EQ(Findings(16), "");
  EXPECT_EQ(Findings(24), "alignment ");
}

// Focal lengths that differ look like this, and no gyroscope does.
TEST(CheckMotion, AGyroscopeIsOffAlikeAboutAllAxes) {
  TurnAlignment turns;
  turns.scale_sigmas = {0.01, 0.01, 0.01};
  const auto name = [&](const Eigen::Vector3d& scales) {
    turns.scales = scales;
    CheckReport report;
    JudgeScales(turns, SmallRig(), &report);
    return report.findings.empty() ? "" : report.findings.front().name;
  };
  EXPECT_EQ(name({1.1, 1.1, 1.1}), "gyro-scale");
  EXPECT_EQ(name({0.9, 1.1, 1.08}), "focal-length");
  EXPECT_EQ(name({1, 1, 1}), "");
}

// One camera took its shifts along a bare corridor for turns.
TEST(CheckMotion, OneCameraIsNoProofOfScalesThatDifferFromAxisToAxis) {
  TurnAlignment turns;
  turns.scale_sigmas = {0.01, 0.01, 1};
  Rig rig = SmallRig();
  const auto findings = [&](double x, double y) {
    turns.scales = {x, y, 0.5};
    CheckReport report;
    EXPECT_EQ(JudgeScales(turns, rig, &report), IsStereo(rig) || x == y);
    return report.findings;
  };
  EXPECT_EQ(findings(0.71, 0.87).at(0).severity, Severity::kError);
  EXPECT_TRUE(findings(1, 1).empty());
  rig.cameras[1] = Camera();
  ASSERT_FALSE(IsStereo(rig));
  EXPECT_EQ(findings(0.71, 0.87).at(0).severity, Severity::kWarning);
  EXPECT_EQ(findings(0.8, 0.8).at(0).severity, Severity::kError);
}

constexpr int kWidth_px = 320, kHeight_px = 240, kCount = 160;
constexpr double kDistant_px = 200;  // focal length

cv::Mat Texture(int width_px, int seed) {
  cv::RNG random(seed);
  cv::Mat texture(2 * kHeight_px, width_px, CV_8UC1);
  random.fill(texture, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(texture, texture, {}, 2);
  cv::normalize(texture, texture, 20, 235, cv::NORM_MINMAX);
  return texture;
}

struct Walk {
  double swing_rad = 0.6;   // to both sides, about the vertical
  double bias_rad_s = 0;    // of the gyroscope
  int carried_rows_px = 0;  // at the lower border, of what moves with the rig
  double orbit_px = 0;      // that the building moves on in an image, instead of by the swing
};

// One camera that looks along z, and an IMU with the same axes. What it sees is far away.
testing::MemorySource Recording(const Walk& walk) {
  const cv::Mat world = Texture(4000, 1), body = Texture(kWidth_px, 2);
  Rig rig;
  rig.cameras[0] = testing::PinholeCamera(kWidth_px, kHeight_px, kDistant_px, 159.5, 119.5);
  std::vector<StereoImage> images;
  std::vector<ImuSample> samples;
  cv::RNG noise(3);
  const auto angle_rad = [&](double t_s) { return walk.swing_rad * std::sin(1.3 * t_s); };
  for (int i = 0; i < kCount; ++i) {
    const double t_s = 0.05 * i;
    const double shift_px = walk.orbit_px > 0 ? walk.orbit_px * i : kDistant_px * angle_rad(t_s);
    cv::Mat image =
        world(cv::Rect(2000 + static_cast<int>(std::lround(shift_px)), 0, kWidth_px, kHeight_px))
            .clone();
    if (walk.carried_rows_px > 0) {
      body(cv::Rect(0, 0, kWidth_px, walk.carried_rows_px))
          .copyTo(image.rowRange(kHeight_px - walk.carried_rows_px, kHeight_px));
    }
    cv::Mat grain(image.size(), CV_16SC1);
    noise.fill(grain, cv::RNG::NORMAL, 0, 2);
    cv::add(image, grain, image, cv::noArray(), CV_8U);
    images.push_back({ToNanoseconds(t_s), image, {}});
  }
  for (int i = 0; i < 10 * kCount; ++i) {
    const double t_s = 0.005 * i;
    const double rate_rad_s = (angle_rad(t_s + 1e-4) - angle_rad(t_s - 1e-4)) / 2e-4;
    samples.push_back({ToNanoseconds(t_s), {0, rate_rad_s + walk.bias_rad_s, 0}, {0, -9.81, 0}});
  }
  return {rig, images, samples};
}

cv::Mat MaskOf(const Walk& walk) {
  testing::MemorySource source = Recording(walk);
  return FindCarried(source, AllSamples(&source), {})[0];
}

TEST(Carried, WhatMovesWithTheRigIsFound) {
  for (const int rows_px : {40, 144}) {
    const cv::Mat mask = MaskOf({.carried_rows_px = rows_px});
    ASSERT_FALSE(mask.empty()) << rows_px;
    EXPECT_EQ(cv::countNonZero(mask.rowRange(kHeight_px - rows_px, kHeight_px)), 0) << rows_px;
    EXPECT_GT(cv::countNonZero(mask), kWidth_px * (kHeight_px - rows_px - 28)) << rows_px;
  }
}

// Nor is a rig at rest, whatever its gyroscope says, or one that turns and moves so that what it
// looks at stays nearly where it is for a while.
TEST(Carried, ABuildingIsNot) {
  EXPECT_TRUE(MaskOf({}).empty());
  EXPECT_TRUE(MaskOf({.swing_rad = 0, .bias_rad_s = 0.09}).empty());
  EXPECT_TRUE(MaskOf({.swing_rad = 0.01, .bias_rad_s = 0.05}).empty());
  EXPECT_TRUE(MaskOf({.orbit_px = 0.2}).empty());
}

constexpr double kNoise_rad = 0.002;

// Steps of a rig that is carried: no two seconds are the same.
Eigen::Vector2d StepAt(int frame) {
  return {0.03 * std::sin(0.31 * frame) + 0.01 * std::sin(1.7 * frame),
          0.02 * std::cos(0.23 * frame)};
}

// Of 160 images that are so many frames later than their places.
template <typename Late>
ImageSteps Steps(const Late& late) {
  ImageSteps steps;
  for (int i = 0; i < 159; ++i) {
    Eigen::Vector2d step(0, 0);
    for (int frame = i + late(i); frame < i + 1 + late(i + 1); ++frame) step += StepAt(frame);
    steps.push_back(step);
  }
  return steps;
}

int InStep(int) { return 0; }
int LostTwice(int i) { return (i >= 50) + (i >= 100); }
int LostAndBack(int i) { return i >= 60 && i < 110 ? 1 : 0; }

TEST(FindLags, FindsEverySlipOfEitherCamera) {
  const ImageSteps right = Steps(LostTwice);
  const std::vector<int> lags = FindLags(Steps(InStep), right, kNoise_rad);
  EXPECT_EQ(lags[20], 0);
  EXPECT_EQ(lags[46], 0);
  EXPECT_EQ(lags[54], -1);
  EXPECT_EQ(lags[96], -1);
  EXPECT_EQ(lags[104], -2);
  EXPECT_EQ(FindLags(right, Steps(InStep), kNoise_rad)[120], 2);
  const std::vector<int> and_back = FindLags(Steps(InStep), Steps(LostAndBack), kNoise_rad);
  EXPECT_EQ(and_back[80], -1);
  EXPECT_EQ(and_back[130], 0);
}

TEST(FindLags, TakesNoiseAndRestForNone) {
  ImageSteps left = Steps(InStep), right = left;
  for (size_t i = 0; i < right.size(); ++i) {
    *right[i] *= 1.05;
    right[i]->x() += 0.001 * std::sin(5.1 * static_cast<double>(i));
    if (i % 9 == 0) right[i].reset();  // could not be followed
    if (i > 60 && i < 90) left[i] = right[i] = Eigen::Vector2d(0, 0);
  }
  for (const int lag : FindLags(left, right, kNoise_rad)) EXPECT_EQ(lag, 0);
}

TEST(LateBy, TellsWhichCameraLostAFrame) {
  const auto late = [](int i) { return i >= 80 ? 1 : 0; };
  const ImageSteps gyro = Steps(InStep);
  EXPECT_EQ(LateBy(Steps(late), gyro, 80, 159), 1);
  EXPECT_EQ(LateBy(Steps(late), gyro, 0, 79), 0);
  EXPECT_EQ(LateBy(Steps(late), ImageSteps(159), 80, 159), 0);  // nothing is known
}

}  // namespace
}  // namespace slcmap
