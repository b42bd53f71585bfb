#include "apps/compare/measure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "data/core/error.h"
#include "mapping/map/map_folder.h"
#include "mapping/mapping.h"
#include "odometry/run/run_folder.h"
#include "tests/testing/edge_walk.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;

// A run over a walk, and trajectories that others made of it.
class MeasureTest : public ::testing::Test {
 protected:
  MeasureTest() {
    const OdometryRun run = testing::RunOver(kWalk);
    WriteRunFolder(folder_.Path("run"), run);
    WriteMapFolder(folder_.Path("map"), MapRun(run, nullptr, {}));
    WriteTumTrajectory(folder_.Path("truth.tum"), kWalk);
    sequence_.name = "walk";
    sequence_.methods = {{"slc", {{folder_.Path("run"), folder_.Path("map"), ""}}, {}, {}}};
    sequence_.reference = 0;
  }

  void Give(const std::string& name, const Trajectory& trajectory) {
    const std::string path = folder_.Path(name + ".tum");
    WriteTumTrajectory(path, trajectory);
    sequence_.methods.push_back({name, {}, ReadTrajectory(path), {}});
  }

  static double Figure(const SequenceResult& result, size_t method, const std::string& key) {
    return result.methods.at(method).repeats.at(0).at(key);
  }

  const Trajectory kWalk = testing::Walk(40);
  testing::TempFolder folder_;
  MeasuredSequence sequence_;
};

// Bent sideways as an arc of a sagitta over the whole way.
Trajectory Bent(Trajectory walk, double sagitta_m) {
  const auto last = static_cast<double>(walk.size() - 1);
  for (size_t i = 0; i < walk.size(); ++i) {
    const double u = static_cast<double>(i) / last;
    walk[i].T_world_imu.translation.y() += 4 * sagitta_m * u * (1 - u);
  }
  return walk;
}

TEST_F(MeasureTest, ABentTrajectoryRanksBehindAStraightOne) {
  Give("bent", Bent(kWalk, 0.01));
  const SequenceResult result = MeasureSequence(sequence_);
  EXPECT_LT(Figure(result, 0, "edge_thickness_mm"), 0.01);
  EXPECT_GT(Figure(result, 1, "edge_thickness_mm"), 2);
  EXPECT_LT(Figure(result, 1, "edge_thickness_mm"), 10);
  EXPECT_FALSE(result.true_poses);
  EXPECT_FALSE(result.methods[1].repeats[0].contains("ape_final_m"));
  EXPECT_THAT(result.reference, HasSubstr("by slc"));
}

TEST_F(MeasureTest, TheSameInAnotherWorldScoresTheSame) {
  Trajectory turned = Bent(kWalk, 0.01);
  const RigidTransform turn(Eigen::Quaterniond(Eigen::AngleAxisd(2, Eigen::Vector3d::UnitZ())),
                            {5, -3, 1});
  for (StampedPose& pose : turned) pose.T_world_imu = turn * pose.T_world_imu;
  Give("bent", Bent(kWalk, 0.01));
  Give("turned", turned);
  const SequenceResult result = MeasureSequence(sequence_);
  for (const char* key : {"edge_thickness_mm", "edge_apart_under_1s_mm"}) {
    EXPECT_NEAR(Figure(result, 2, key), Figure(result, 1, key), 1e-3) << key;
  }
}

TEST_F(MeasureTest, TruePosesGiveErrorsAndTheFloor) {
  sequence_.true_poses = folder_.Path("truth.tum");
  Give("bent", Bent(kWalk, 0.01));
  const SequenceResult result = MeasureSequence(sequence_);
  EXPECT_LT(Figure(result, 0, "ape_final_m"), 1e-5);
  EXPECT_GT(Figure(result, 1, "ape_final_m"), 0.002);
  EXPECT_LT(result.with_true_poses.at("edge_thickness_mm"), 0.01);
  EXPECT_NEAR(result.length_m, 39 * testing::kWalkStep_m, 1e-6);
}

// The start may go without poses: that is no fault, but it is counted.
TEST_F(MeasureTest, CoverageIsOfAllImages) {
  sequence_.true_poses = folder_.Path("truth.tum");
  Give("later", Trajectory(kWalk.begin() + 2, kWalk.end()));
  const SequenceResult result = MeasureSequence(sequence_);
  EXPECT_NEAR(Figure(result, 0, "coverage_percent"), 100, 1e-9);
  EXPECT_NEAR(Figure(result, 1, "coverage_percent"), 95, 1e-9);
  EXPECT_THAT(result.methods[1].remarks, ::testing::Not(::testing::Contains(HasSubstr("covers"))));
}

TEST_F(MeasureTest, WhereTruePosesAreTheWorstTheyAreNoFloor) {
  WriteTumTrajectory(folder_.Path("truth.tum"), Bent(kWalk, 0.01));
  sequence_.true_poses = folder_.Path("truth.tum");
  const SequenceResult result = MeasureSequence(sequence_);
  EXPECT_FALSE(result.truth_is_floor);
  EXPECT_FALSE(result.methods[0].repeats[0].contains("edge_thickness_beyond_mm"));
}

TEST_F(MeasureTest, AShortTrajectoryDoesNotDecideWhatIsMeasured) {
  Give("short", Trajectory(kWalk.begin(), kWalk.begin() + 20));
  const SequenceResult result = MeasureSequence(sequence_);
  EXPECT_THAT(result.reference, HasSubstr("160 observations of edges"));
  ASSERT_EQ(result.methods[1].remarks.size(), 1u);
  EXPECT_THAT(result.methods[1].remarks[0], HasSubstr("no pose for many"));
  EXPECT_TRUE(result.methods[0].remarks.empty());
}

TEST_F(MeasureTest, ATrajectoryOfAnotherTimeIsAMethodThatFails) {
  sequence_.true_poses = folder_.Path("truth.tum");
  Trajectory late = kWalk;
  for (StampedPose& pose : late) pose.stamp_ns += 1000000000000;
  Give("late", late);
  const SequenceResult result = MeasureSequence(sequence_);
  EXPECT_FALSE(result.methods[1].repeats[0].contains("ape_final_m"));
  EXPECT_FALSE(result.methods[1].remarks.empty());
}

TEST_F(MeasureTest, RunsWithoutLinesGiveNoObservations) {
  EXPECT_EQ(ReferenceAmong(sequence_.methods), 0u);
  OdometryRun points = testing::RunOver(kWalk);
  for (Keyframe& keyframe : points.keyframes) keyframe.lines.clear();
  WriteRunFolder(folder_.Path("points"), points);
  EXPECT_FALSE(ReferenceAmong({{"points", {{folder_.Path("points"), "", ""}}, {}, {}}}));
}

}  // namespace
}  // namespace slcmap
