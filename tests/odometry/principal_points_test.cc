// What is found of principal points, on simulated tracks whose pixels are moved.
#include "odometry/principal_points.h"

#include <gtest/gtest.h>

#include "tests/testing/simulated_odometry.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;

class PrincipalPointsTest : public ::testing::Test {
 protected:
  PrincipalPointsTest() {
    options_.odometry.method = Method::kPoints;
    options_.pixel_sigma_px = options_.odometry.window.point_sigma_px = 0.25;
    options_.imu_noise = true;
    options_.duration_s = 20;
    options_.seed = 5;
  }

  // A run whose cameras saw everything so much further right and down.
  OdometryRun RunMoved(const Vector2d& left_px, const Vector2d& right_px) const {
    SimulatedRun simulated = RunOnSimulatedTracks(options_);
    OdometryRun run = std::move(simulated.run);
    run.rectified_rig = simulated.rig;
    for (Keyframe& keyframe : run.keyframes) {
      for (KeyframeObservation& seen : keyframe.observations) {
        seen.left_px += left_px;
        if (seen.right_px) *seen.right_px += right_px;
      }
    }
    return run;
  }

  std::optional<PrincipalPoints> Fit(const OdometryRun& run) const {
    return FitPrincipalPoints(run.rectified_rig, options_.odometry, run);
  }

  SimulatedRunOptions options_;
};

TEST_F(PrincipalPointsTest, AreFoundAsWellAsIsClaimed) {
  const std::array<Vector2d, 2> moved_px{Vector2d(2, -1.5), Vector2d(1.5, -2)};
  const auto found = Fit(RunMoved(moved_px[0], moved_px[1]));
  ASSERT_TRUE(found);
  for (int camera = 0; camera < 2; ++camera) {
    for (int i = 0; i < 2; ++i) {
      const double sigma_px = found->sigma_px[camera][i];
      EXPECT_NEAR(found->offset_px[camera][i], moved_px[camera][i], 3 * sigma_px);
      EXPECT_LT(sigma_px, 1);
      EXPECT_GT(sigma_px, 0.01);
    }
  }
}

// Poses and points of a run that has found the right one itself are right with it only.
TEST_F(PrincipalPointsTest, ComeOnTopOfWhatTheRunHasFound) {
  const Vector2d known_px(2.5, -1);
  OdometryRun run = RunMoved({0, 0}, known_px);
  const auto alone = Fit(run);
  ASSERT_FALSE(run.calibration.empty());
  run.calibration.back().right_centre_px = known_px;
  const auto found = Fit(run);
  ASSERT_TRUE(alone && found);
  for (int i = 0; i < 2; ++i) {
    EXPECT_NEAR(found->offset_px[1][i], known_px[i], 3 * found->sigma_px[1][i]);
    EXPECT_LT(found->sigma_px[1][i], 1.2 * alone->sigma_px[1][i]);
  }
}

TEST_F(PrincipalPointsTest, NothingIsToldOfWhatIsNotWantedNorSeen) {
  OdometryRun run = RunMoved({0, 0}, {0, 0});
  EXPECT_TRUE(Fit(run));
  options_.odometry.calibration.principal_points = false;
  EXPECT_FALSE(Fit(run));
  options_.odometry.calibration.principal_points = true;
  options_.odometry.method = Method::kPointsMono;
  EXPECT_FALSE(Fit(run));
  options_.odometry.method = Method::kPoints;
  run.keyframes.resize(options_.odometry.window.max_keyframes - 1);
  EXPECT_FALSE(Fit(run));
}

}  // namespace
}  // namespace slcmap
