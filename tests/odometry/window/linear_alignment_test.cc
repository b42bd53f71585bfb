#include "odometry/window/linear_alignment.h"

#include <gtest/gtest.h>

#include "tests/testing/simulated_odometry.h"

namespace slcmap {
namespace {

TEST(AlignLinearly, FindsGravityAndVelocityFromPerfectTracks) {
  for (const bool stereo : {true, false}) {
    const Rig rig = ExampleStereoRig();
    const MotionSpline motion = ExampleFlight(rig, 6);
    ImuSimulatorOptions imu;
    imu.noise = rig.imu_noise;
    imu.noise.rate_hz = 1000;
    imu.with_noise = false;
    const SimulatedImu samples = SimulateImu(motion, imu);
    const SimulatedTracks tracks = SimulateTracks(motion, rig, {});
    std::vector<std::unique_ptr<FrameState>> frames;
    const Camera& camera = rig.cameras[0];
    const auto on_plane = [&](const Eigen::Vector2d& px) {
      return Eigen::Vector2d((px.x() - camera.cx_px) / camera.fx_px,
                             (px.y() - camera.cy_px) / camera.fy_px);
    };
    for (size_t i = 60; i < 80; ++i) {  // from 3 s to 4 s
      auto frame = std::make_unique<FrameState>();
      frame->stamp_ns = tracks.frames[i].stamp_ns;
      for (const SimulatedTrack& track : tracks.frames[i].tracks) {
        StereoMeasurement& m = frame->measurements[track.id];
        m.left = on_plane(track.left_px);
        if (stereo && track.right_px) m.right = on_plane(*track.right_px);
      }
      if (!frames.empty()) {
        frame->from_previous = std::make_unique<Preintegration>(
            rig.imu_noise, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
        for (const ImuSample& s : samples.samples) {
          if (s.stamp_ns >= frames.back()->stamp_ns && s.stamp_ns <= frame->stamp_ns) {
            frame->from_previous->Append(s);
          }
        }
      }
      frames.push_back(std::move(frame));
    }
    const auto alignment = AlignLinearly(frames, StereoGeometry(rig.T_imu_camera, 600),
                                         rig.imu_noise, Eigen::Vector3d::Zero());
    ASSERT_TRUE(alignment.has_value());
    // Without the stereo baseline the scale hangs on the accelerations alone.
    EXPECT_NEAR(alignment->free_gravity_m_s2, kGravity_m_s2, stereo ? 0.02 : 0.2) << stereo;
    const RigidTransform first = motion.PoseAt(3);
    const Eigen::Vector3d gravity = first.rotation.conjugate() * Eigen::Vector3d(0, 0, -9.81);
    EXPECT_LT((alignment->gravity_first_m_s2 - gravity).norm(), 0.02);
    for (size_t i = 0; i < frames.size(); ++i) {
      const RigidTransform truth = first.Inverse() * motion.PoseAt(ToSeconds(frames[i]->stamp_ns));
      EXPECT_LT((alignment->states[i].T_first_imu.translation - truth.translation).norm(), 0.01);
    }
  }
}

}  // namespace
}  // namespace slcmap
