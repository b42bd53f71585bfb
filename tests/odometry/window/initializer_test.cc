// What a failed initialisation leaves behind.
#include "odometry/window/initializer.h"

#include <gtest/gtest.h>

#include "odometry/geometry/pinhole.h"
#include "odometry/window/linear_alignment.h"
#include "tests/testing/simulated_odometry.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr int64_t kLate_ns = 60'000'000;  // of the images' stamps, without a word of it

using Frames = std::vector<std::unique_ptr<FrameState>>;

// What a rig with one camera or two sees in a frame, later by so much, and feels since the last.
void AddFrame(const Rig& rig, const SimulatedTrackFrame& seen, const ImuBuffer& imu, bool stereo,
              int64_t late_ns, Frames* frames) {
  auto frame = std::make_unique<FrameState>();
  frame->id = std::ssize(*frames);
  frame->stamp_ns = seen.stamp_ns + late_ns;
  frame->cut = MakeCut(imu, frame->stamp_ns, 0);
  for (const SimulatedTrack& track : seen.tracks) {
    StereoMeasurement& measurement = frame->measurements[track.id];
    measurement.left = PlaneFromPixel(rig.cameras[0], track.left_px);
    if (!stereo || !track.right_px) continue;
    measurement.right = PlaneFromPixel(rig.cameras[1], *track.right_px);
  }
  if (!frames->empty()) {
    frame->from_previous =
        std::make_unique<Preintegration>(rig.imu_noise, Vector3d::Zero(), Vector3d::Zero());
    for (const ImuSample& sample : imu.Between(frames->back()->stamp_ns, frame->stamp_ns)) {
      frame->from_previous->Append(sample);
    }
  }
  frames->push_back(std::move(frame));
}

SimulatedImu ExactImu(const MotionSpline& motion, double rate_hz) {
  ImuSimulatorOptions options;
  options.noise.rate_hz = rate_hz;
  options.with_noise = false;
  return SimulateImu(motion, options);
}

// A rig in motion whose initialisation never succeeds.
class FailedInitialization : public ::testing::Test {
 protected:
  FailedInitialization() {
    options_.method = Method::kPoints;
    options_.initializer.max_reprojection_sigma = 1e-6;
    const MotionSpline motion = ExampleFlight(rig_, 4, 0);
    for (const ImuSample& sample : ExactImu(motion, 200).samples) imu_.Add(sample);
    for (const SimulatedTrackFrame& frame : SimulateTracks(motion, rig_, {}).frames) {
      AddFrame(rig_, frame, imu_, true, kLate_ns, &frames_);
    }
  }

  // Adds frames until an attempt was made, and returns how many there were.
  size_t Try(Initializer* initializer, SlidingWindow* window) {
    size_t used = 0;
    while (!initializer->Ready()) initializer->AddFrame(std::move(frames_.at(used++)));
    EXPECT_FALSE(initializer->Try(std::nullopt, imu_, window).success);
    return used;
  }

  const Rig rig_ = ExampleStereoRig();
  OdometryOptions options_;
  ImuBuffer imu_;
  Frames frames_;
};

// The time offset that it found on the way was never confirmed; and the samples of the next image
// start where those of the last one ended.
TEST_F(FailedInitialization, LeavesTheCutsWhereTheyWere) {
  Initializer initializer(options_.initializer, rig_);
  SlidingWindow window(options_, rig_);
  const int64_t first_ns = frames_.front()->stamp_ns, step_ns = frames_[1]->stamp_ns - first_ns;
  const size_t used = Try(&initializer, &window);
  const auto forgotten = static_cast<int64_t>(used - initializer.size());
  EXPECT_EQ(initializer.first_cut_ns(), first_ns + forgotten * step_ns);
}

TEST_F(FailedInitialization, BelievesRowsAsBefore) {
  for (auto& frame : frames_) {
    for (auto& [id, measurement] : frame->measurements) {
      if (measurement.right) measurement.right->y() += 2e-3;  // rows that do not fit
    }
  }
  Initializer initializer(options_.initializer, rig_);
  SlidingWindow window(options_, rig_);
  Try(&initializer, &window);
  EXPECT_TRUE(window.calibration_prior().options().rows_fit);
}

// A second of a flight, from 3 s on: perfect tracks and samples, but for what is wrong with the
// IMU.
struct Second {
  explicit Second(bool stereo, const Vector3d& gyro_bias_rad_s = Vector3d::Zero(),
                  double accel_scale = 1) {
    ImuBuffer imu;
    for (ImuSample sample : ExactImu(motion, 1000).samples) {
      sample.angular_velocity_rad_s += gyro_bias_rad_s;
      sample.specific_force_m_s2 *= accel_scale;
      imu.Add(sample);
    }
    const SimulatedTracks tracks = SimulateTracks(motion, rig, {});
    for (size_t i = 60; i < 80; ++i) AddFrame(rig, tracks.frames[i], imu, stereo, 0, &frames);
  }

  void ExpectTruth(const LinearAlignment& alignment) const {
    const RigidTransform first = motion.PoseAt(3);
    for (size_t i = 0; i < frames.size(); ++i) {
      const RigidTransform truth = first.Inverse() * motion.PoseAt(ToSeconds(frames[i]->stamp_ns));
      EXPECT_LT((alignment.states[i].T_first_imu.translation - truth.translation).norm(), 0.01);
    }
  }

  const Rig rig = ExampleStereoRig();
  const MotionSpline motion = ExampleFlight(rig, 6);
  const StereoGeometry geometry{rig.T_imu_camera, 600};
  Frames frames;
};

TEST(AlignLinearly, FindsGravityAndVelocityFromPerfectTracks) {
  for (const bool stereo : {true, false}) {
    const Second second(stereo);
    const auto alignment =
        AlignLinearly(second.frames, second.geometry, second.rig.imu_noise, Vector3d::Zero());
    ASSERT_TRUE(alignment.has_value());
    // Without the stereo baseline the scale hangs on the accelerations alone.
    EXPECT_NEAR(alignment->free_gravity_m_s2, kGravity_m_s2, stereo ? 0.02 : 0.2) << stereo;
    const Vector3d gravity =
        second.motion.PoseAt(3).rotation.conjugate() * Vector3d(0, 0, -kGravity_m_s2);
    EXPECT_LT((alignment->gravity_first_m_s2 - gravity).norm(), 0.02);
    second.ExpectTruth(*alignment);
  }
}

TEST(AlignLinearly, IsFreeOfTheAccelerometersScaleWhereItIsTold) {
  constexpr double kScale = 1.028;
  const Second second(false, Vector3d::Zero(), kScale);
  const auto alignment = AlignLinearly(second.frames, second.geometry, second.rig.imu_noise,
                                       Vector3d::Zero(), ImuErrors::Zero(), kScale * kGravity_m_s2);
  ASSERT_TRUE(alignment.has_value());
  second.ExpectTruth(*alignment);
}

TEST(GyroBiasFromImages, IsThatOfTheGyroscope) {
  const Vector3d bias_rad_s(0.02, -0.05, 0.03);
  const Second second(false, bias_rad_s);
  const auto found = GyroBiasFromImages(second.frames, second.geometry, second.rig.imu_noise, 0.25);
  ASSERT_TRUE(found.has_value());
  EXPECT_LT((*found - bias_rad_s).norm(), 0.002);
}

}  // namespace
}  // namespace slcmap
