#include "tests/testing/track_simulator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "data/core/error.h"
#include "tests/testing/example.h"

namespace slcmap {
namespace {

class TrackSimulatorTest : public ::testing::Test {
 protected:
  // Calls visit(track, exact left pixel, exact right pixel where in view) for every measurement.
  template <typename Visit>
  void ForEach(const SimulatedTracks& tracks, Visit visit) const {
    for (const SimulatedTrackFrame& frame : tracks.frames) {
      for (const SimulatedTrack& track : frame.tracks) {
        std::optional<Eigen::Vector2d> pixel[2];
        for (int c = 0; c < 2; ++c) {
          const RigidTransform T_world_camera = frame.T_world_imu * rig_.T_imu_camera[c];
          pixel[c] =
              rig_.cameras[c].Project(T_world_camera.Inverse() * tracks.landmarks_world[track.id]);
        }
        visit(track, *pixel[0], pixel[1]);
      }
    }
  }

  const Rig rig_ = ExampleStereoRig();
  const MotionSpline motion_ = ExampleFlight(rig_, 10.0);
};

TEST_F(TrackSimulatorTest, WithoutNoiseTracksReprojectExactly) {
  const SimulatedTracks tracks = SimulateTracks(motion_, rig_, {});
  ASSERT_EQ(tracks.frames.size(), 201u);
  EXPECT_EQ(tracks.frames[20].stamp_ns, 1'000'000'000);
  int measurements = 0, stereo = 0;
  ForEach(tracks, [&](const SimulatedTrack& track, const auto& left, const auto& right) {
    ++measurements;
    EXPECT_LT((track.left_px - left).norm(), 1e-9);
    if (!track.right_px) return;
    ++stereo;
    EXPECT_LT((*track.right_px - *right).norm(), 1e-9);
    EXPECT_NEAR(track.right_px->y(), track.left_px.y(), 1e-6);  // a rectified rig
    EXPECT_LT(track.right_px->x(), track.left_px.x());
  });
  EXPECT_EQ(measurements, 201 * 150);
  EXPECT_GT(stereo, 0.85 * measurements);
}

TEST_F(TrackSimulatorTest, TracksLastWhileInViewOrUntilTheyAreTooOld) {
  TrackSimulatorOptions options;
  for (const int longest : {0, 15}) {
    options.max_track_frames = longest;
    std::map<int64_t, int> frames;
    for (const auto& frame : SimulateTracks(motion_, rig_, options).frames) {
      for (const auto& track : frame.tracks) ++frames[track.id];
    }
    int most = 0;
    for (const auto& [id, count] : frames) most = std::max(most, count);
    if (longest == 0) {
      EXPECT_GT(most, 30);
    } else {
      EXPECT_EQ(most, longest);
    }
  }
}

TEST_F(TrackSimulatorTest, NoiseHasItsSigma) {
  TrackSimulatorOptions options;
  options.sigma_px = 0.5;
  double sum = 0;
  int count = 0;
  ForEach(SimulateTracks(motion_, rig_, options),
          [&](const SimulatedTrack& track, const auto& left, const auto& right) {
            sum += (track.left_px - left).squaredNorm();
            count += 2;
            if (!track.right_px) return;
            sum += (*track.right_px - *right).squaredNorm();
            count += 2;
          });
  EXPECT_NEAR(std::sqrt(sum / count), 0.5, 0.01);
}

TEST_F(TrackSimulatorTest, StampsCarryTheCameraTimeOffset) {
  Rig late = rig_;
  late.camera_time_offset_s = 0.02;  // the camera's clock is behind the IMU's
  const SimulatedTracks tracks = SimulateTracks(motion_, late, {});
  const SimulatedTrackFrame& frame = tracks.frames[7];
  const RigidTransform truth = motion_.PoseAt(ToSeconds(frame.stamp_ns) + 0.02);
  EXPECT_LT((frame.T_world_imu.translation - truth.translation).norm(), 1e-7);
  EXPECT_GE(tracks.frames.front().stamp_ns, 0);
}

TEST_F(TrackSimulatorTest, RefusesNegativeNoise) {
  TrackSimulatorOptions options;
  options.sigma_px = -1;
  EXPECT_THROW(SimulateTracks(motion_, rig_, options), ConfigError);
}

}  // namespace
}  // namespace slcmap
