#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core/utility.hpp>

#include "data/core/error.h"
#include "mapping/external_poses/pose_adjustment.h"
#include "tests/testing/room_views.h"

namespace slcmap {
namespace {

class GivenPosesTest : public ::testing::Test {
 protected:
  // The views with every second one turned by two pixels and more.
  Views Turned() const {
    const double angle_rad = 2 / room_.rig().cameras[0].fx_px;
    Views views = room_.views();
    for (size_t i = 0; i < views.size(); i += 2) {
      RigidTransform& pose = views[i].T_world_imu;
      pose.rotation = pose.rotation * ExpRotation({0, angle_rad, 0.5 * angle_rad});
    }
    return views;
  }

  // Between neighbours, the mean (rad).
  double TurnOff(const Views& views) const {
    double sum = 0;
    for (size_t i = 1; i < views.size(); ++i) {
      const auto between = [&](const Views& of) {
        return of[i - 1].T_world_imu.rotation.conjugate() * of[i].T_world_imu.rotation;
      };
      sum += between(room_.views()).angularDistance(between(views));
    }
    return sum / static_cast<double>(views.size() - 1);
  }

  static GivenViews Given(const Views& views) {
    return {views, std::vector<PoseMove>(views.size())};
  }

  OdometryRun RunOf(const Views& views) const {
    OdometryRun run;
    for (const View& view : views) {
      Keyframe keyframe;
      keyframe.stamp_ns = view.stamp_ns;
      keyframe.segment = view.segment;
      keyframe.T_world_imu = view.T_world_imu;
      run.keyframes.push_back(keyframe);
    }
    return run;
  }

  RoomViews room_{4, 0.25, 3};
  ExternalPoseOptions options_;
};

TEST_F(GivenPosesTest, TurnedViewsAreTurnedBack) {
  const Views given = Turned();
  const auto adjusted = AdjustGivenViews(Given(given), room_, options_);
  ASSERT_TRUE(adjusted);
  EXPECT_GT(adjusted->figures.given_off_px, 1);
  EXPECT_LT(adjusted->figures.off_px, 0.3);
  EXPECT_LT(TurnOff(adjusted->views), 0.25 * TurnOff(given));
  EXPECT_GT(adjusted->figures.pairs, 10);
  EXPECT_GT(adjusted->figures.turned_rad, 0.0005);
}

TEST_F(GivenPosesTest, TruePosesStay) {
  EXPECT_FALSE(AdjustGivenViews(Given(room_.views()), room_, options_));
}

TEST_F(GivenPosesTest, NothingIsMovedThatIsNotSeenTwice) {
  EXPECT_FALSE(AdjustGivenViews(Given({room_.views().front()}), room_, options_));
  Views apart = room_.views();
  for (size_t i = 0; i < apart.size(); ++i) {
    apart[i].T_world_imu.translation.x() += 100.0 * static_cast<double>(i);
  }
  EXPECT_FALSE(AdjustGivenViews(Given(apart), room_, options_));
}

TEST_F(GivenPosesTest, IsTheSameOnAnyNumberOfThreads) {
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const auto one = AdjustGivenViews(Given(Turned()), room_, options_);
  cv::setNumThreads(3);
  const auto three = AdjustGivenViews(Given(Turned()), room_, options_);
  cv::setNumThreads(threads);
  ASSERT_TRUE(one && three);
  for (size_t i = 0; i < one->views.size(); ++i) {
    const RigidTransform &a = one->views[i].T_world_imu, &b = three->views[i].T_world_imu;
    EXPECT_EQ(a.translation, b.translation);
    EXPECT_EQ(a.rotation.coeffs(), b.rotation.coeffs());
  }
}

TEST_F(GivenPosesTest, KeyframesOfARunAreMovedUnlessThatIsNotWanted) {
  OdometryRun run = RunOf(Turned());
  options_.adjust = false;
  EXPECT_FALSE(AdjustExternalPoses(room_, options_, &run));
  const Eigen::Quaterniond given = run.keyframes[2].T_world_imu.rotation;
  EXPECT_EQ(given.coeffs(), Turned()[2].T_world_imu.rotation.coeffs());
  options_.adjust = true;
  EXPECT_TRUE(AdjustExternalPoses(room_, options_, &run));
  EXPECT_GT(run.keyframes[2].T_world_imu.rotation.angularDistance(given), 0.0005);
}

// States that the way and its turns are told by, as a clock has them that is 40 ms off; those
// between keyframes are corrected where the rig moves, and stay where it stands.
TEST_F(GivenPosesTest, AClockThatIsOffIsMendedInStatesToo) {
  OdometryRun run;
  const Views& views = room_.views();
  const RigidTransform first = views[0].T_world_imu;
  const auto pose_at = [&](double s) {  // turns while it moves, and stands from 1 s on
    const double moving_s = std::min(s, 1.0);
    return first * RigidTransform(ExpRotation({0, 0, 0.8 * moving_s}), {0.4 * moving_s, 0, 0});
  };
  for (int i = 0; i <= 40; ++i) {
    OnlineState state;
    state.stamp_ns = 50'000'000LL * i;
    state.T_world_imu = pose_at(0.05 * i);
    run.states.push_back(state);
  }
  const PoseCorrection correction{{}, 0.04, {}};
  const std::vector<OnlineState> corrected = CorrectedStates(run.states, correction);
  for (const int i : {0, 7, 15}) {
    const RigidTransform truth = pose_at(0.05 * i + 0.04);
    EXPECT_LT((corrected[i].T_world_imu.translation - truth.translation).norm(), 5e-4) << i;
    EXPECT_LT(corrected[i].T_world_imu.rotation.angularDistance(truth.rotation), 1e-3) << i;
  }
  EXPECT_EQ(corrected[35].T_world_imu.translation, run.states[35].T_world_imu.translation);
}

TEST_F(GivenPosesTest, ARunThatIsInterruptedStaysAsItWas) {
  OdometryRun run = RunOf(Turned());
  EXPECT_FALSE(AdjustExternalPoses(room_, options_, &run, Progress([](double done) {
                                     return done < 0.8;  // in the second round
                                   })));
  EXPECT_EQ(run.keyframes[2].T_world_imu.rotation.coeffs(),
            Turned()[2].T_world_imu.rotation.coeffs());
}

TEST_F(GivenPosesTest, AnOptionOutOfRangeIsNamed) {
  options_.sigma_m = 0;
  EXPECT_THAT(
      [&] { AdjustGivenViews(Given(Turned()), room_, options_); },
      ::testing::ThrowsMessage<ConfigError>(::testing::HasSubstr("mapping.given_poses.sigma_m")));
}

}  // namespace
}  // namespace slcmap
