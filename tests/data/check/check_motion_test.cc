// What the check looks at of a recording that shows little where it moves most.
#include <gtest/gtest.h>

#include "data/calibration/calibration.h"
#include "data/check/check.h"
#include "data/check/image_motion.h"
#include "data/check/turn_alignment.h"
#include "data/simulator/motion.h"
#include "tests/testing/box_room_renderer.h"
#include "tests/testing/example.h"
#include "tests/testing/memory_source.h"

namespace slcmap {
namespace {

constexpr double kDuration_s = 24, kRate_hz = 20;

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
  for (const PairRange& part : LiveliestParts(info, imu, kDuration_s - dark_s, dark_s)) {
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
  std::vector<ImuSample> samples;
  for (auto sample = imu.NextImu(); sample; sample = imu.NextImu()) samples.push_back(*sample);
  CheckReport report;
  CheckMotion(source, source.info().rig, samples, Progress(), &report);
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

}  // namespace
}  // namespace slcmap
