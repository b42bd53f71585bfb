#include "odometry/window/estimator.h"

#include <gtest/gtest.h>

#include "tests/testing/simulated_odometry.h"

namespace slcmap {
namespace {

SimulatedRunOptions Perfect() {
  SimulatedRunOptions options;
  options.imu_rate_hz = 1000;  // the integration's error falls with the square of the step
  return options;
}

TEST(Estimator, PerfectTracksGiveThePerfectPath) {
  const SimulatedRun run = RunOnSimulatedTracks(Perfect());
  ASSERT_GT(run.states.size(), 300u);
  std::printf("largest error %.3e m, %zu removed\n", LargestPositionError(run), run.removed_points);
  EXPECT_LT(LargestPositionError(run), 1e-4);
  EXPECT_EQ(run.removed_points, 0u);
}

}  // namespace
}  // namespace slcmap
