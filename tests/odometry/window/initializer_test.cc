// What a failed initialisation leaves behind.
#include "odometry/window/initializer.h"

#include <gtest/gtest.h>

#include "odometry/geometry/pinhole.h"
#include "tests/testing/simulated_odometry.h"

namespace slcmap {
namespace {

constexpr int64_t kLate_ns = 60'000'000;  // of the images' stamps, without a word of it

// A rig in motion whose initialisation never succeeds.
class FailedInitialization : public ::testing::Test {
 protected:
  FailedInitialization() {
    options_.method = Method::kPoints;
    options_.initializer.max_reprojection_sigma = 1e-6;
    const MotionSpline motion = ExampleFlight(rig_, 4, 0);
    ImuSimulatorOptions imu;
    imu.noise = rig_.imu_noise;
    imu.with_noise = false;
    for (const ImuSample& sample : SimulateImu(motion, imu).samples) imu_.Add(sample);
    for (const SimulatedTrackFrame& frame : SimulateTracks(motion, rig_, {}).frames) {
      frames_.push_back(MakeFrame(frame));
    }
  }

  std::unique_ptr<FrameState> MakeFrame(const SimulatedTrackFrame& seen) const {
    auto frame = std::make_unique<FrameState>();
    frame->id = static_cast<int64_t>(frames_.size());
    frame->stamp_ns = seen.stamp_ns + kLate_ns;
    frame->cut = MakeCut(imu_, frame->stamp_ns, 0);
    for (const SimulatedTrack& track : seen.tracks) {
      StereoMeasurement& measurement = frame->measurements[track.id];
      measurement.left = PlaneFromPixel(rig_.cameras[0], track.left_px);
      if (track.right_px) measurement.right = PlaneFromPixel(rig_.cameras[1], *track.right_px);
    }
    if (!frames_.empty()) {
      frame->from_previous = std::make_unique<Preintegration>(
          rig_.imu_noise, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
      for (const ImuSample& s : imu_.Between(frames_.back()->stamp_ns, frame->stamp_ns)) {
        frame->from_previous->Append(s);
      }
    }
    return frame;
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
  std::vector<std::unique_ptr<FrameState>> frames_;
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

}  // namespace
}  // namespace slcmap
