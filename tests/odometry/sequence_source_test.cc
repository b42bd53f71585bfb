// That a recording which is no folder can be checked and gives a motion.
#include "data/source/sequence_source.h"

#include <gtest/gtest.h>

#include "data/check/check.h"
#include "data/simulator/motion.h"
#include "odometry/odometry.h"
#include "tests/testing/box_room_renderer.h"
#include "tests/testing/example.h"
#include "tests/testing/memory_source.h"

namespace slcmap {
namespace {

constexpr double kSourceRest_s = 1, kSourceDuration_s = 3, kSourceRate_hz = 20;

class SequenceSourceTest : public ::testing::Test {
 protected:
  SequenceSourceTest() {
    for (double t_s = 0.1; t_s < kSourceDuration_s - 0.1; t_s += 1 / kSourceRate_hz) {
      task_.times_s.push_back(t_s);
    }
    BoxRoomRenderer renderer(task_, 2.5);
    for (size_t i = 0; i < task_.times_s.size(); ++i) {
      const RenderedPair pair = renderer.Render(static_cast<int>(i), false);
      pairs_.push_back({ToNanoseconds(task_.times_s[i]), pair.left, pair.right});
    }
  }

  testing::MemorySource Source() const {
    return {task_.rig, pairs_, SimulateImu(task_.motion, {}).samples};
  }

  RenderTask task_{SmallRig(), ExampleFlight(SmallRig(), kSourceDuration_s, kSourceRest_s), {}};
  std::vector<StereoImage> pairs_;
};

std::string Names(const CheckReport& report) {
  std::string names;
  for (const CheckFinding& finding : report.findings) names += finding.name + " ";
  return names;
}

TEST_F(SequenceSourceTest, CanBeChecked) {
  pairs_[20].right = cv::Mat();
  testing::MemorySource source = Source();
  const CheckReport report = CheckSource(&source);
  EXPECT_TRUE(report.Usable()) << CheckTable(report);
  EXPECT_EQ(report.sequence, "memory");
  EXPECT_NE(Names(report).find("images-missing"), std::string::npos) << CheckTable(report);
  EXPECT_NE(CheckTable(report).find("1 of 57 images of cam1, first image 20 of cam1"),
            std::string::npos)
      << CheckTable(report);
}

TEST_F(SequenceSourceTest, FeedsOdometry) {
  pairs_[20].right = cv::Mat();
  testing::MemorySource source = Source();
  OdometryOptions options;
  options.points.min_distance_px = 10;
  options.keyframes.min_parallax_px = 6;
  Odometry odometry(source.info().rig, options);
  std::vector<OnlineState> states;
  while (const auto pair = source.NextPair(std::numeric_limits<int64_t>::min())) {
    for (auto sample = source.NextImu(); sample; sample = source.NextImu()) {
      odometry.AddImu(*sample);
      if (sample->stamp_ns >= pair->stamp_ns) break;
    }
    const auto added = odometry.AddStereo(*pair, pair->decode);
    states.insert(states.end(), added.begin(), added.end());
  }
  EXPECT_EQ(source.warnings().Count(kImageMissing), 1);
  ASSERT_GT(states.size(), pairs_.size() / 2);
  const RigidTransform estimated = states.front().T_world_imu.Inverse() * states.back().T_world_imu;
  const RigidTransform truth = task_.motion.PoseAt(ToSeconds(states.front().stamp_ns)).Inverse() *
                               task_.motion.PoseAt(ToSeconds(states.back().stamp_ns));
  EXPECT_LT((estimated.translation - truth.translation).norm(), 0.05);
  EXPECT_GT(truth.translation.norm(), 0.3);
}

}  // namespace
}  // namespace slcmap
