#include "mapping/external_poses/pose_adjustment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core/utility.hpp>
#include <random>
#include <utility>

#include "data/core/rigid_transform.h"
#include "tests/testing/pinhole_camera.h"
#include "tests/testing/room_views.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

// Views along a wall that is full of points, at true poses, with what is found of the points in the
// views before and after.
class PoseAdjustmentTest : public ::testing::Test {
 protected:
  static constexpr size_t kViews = 8;

  PoseAdjustmentTest() {
    const Camera camera = testing::PinholeCamera(640, 480, 400, 320, 240);
    rig_.cameras = {camera, camera};
    const Eigen::Quaterniond R_imu_camera = ExpRotation({0.1, -0.2, 1.5});
    rig_.T_imu_camera = {RigidTransform(R_imu_camera, {0.02, -0.05, 0.01}),
                         RigidTransform(R_imu_camera, {0.02, 0.05, 0.01})};
    for (size_t i = 0; i < kViews; ++i) {
      const double x = static_cast<double>(i);
      const RigidTransform T_world_camera(
          ExpRotation({0.2 * std::sin(x), 0.2 * std::cos(2 * x), 0.2 * std::sin(1.7 * x)}),
          {0.2 * x, 0.05 * x, 0});
      true_.push_back(
          {static_cast<int64_t>(i), 0, T_world_camera * rig_.T_imu_camera[0].Inverse()});
    }
  }

  std::vector<PoseMatch> Matches(double noise_px) {
    std::uniform_real_distribution<double> place(-1.5, 1.5), depth(2, 5);
    std::normal_distribution<double> noise(0, noise_px);
    std::vector<PoseMatch> matches;
    for (size_t from = 0; from < kViews; ++from) {
      for (size_t to = 0; to < kViews; ++to) {
        if (from == to || std::max(from, to) - std::min(from, to) > 3) continue;
        for (int i = 0; i < 30; ++i) {
          PoseMatch match{from, to, {place(random_), place(random_), depth(random_)}, 0.004, {}};
          match.px = *OffMatch_px(match, true_, rig_);
          match.px += Eigen::Vector2d(noise(random_), noise(random_));
          matches.push_back(match);
        }
      }
    }
    return matches;
  }

  // Each off by itself.
  GivenViews Given(double sigma_m, double sigma_rad) {
    std::normal_distribution<double> way(0, sigma_m), turn(0, sigma_rad);
    GivenViews given{true_, std::vector<PoseMove>(kViews)};
    for (View& view : given.views) {
      const Vector3d w(turn(random_), turn(random_), turn(random_));
      view.T_world_imu =
          view.T_world_imu *
          RigidTransform(ExpRotation(w), Vector3d(way(random_), way(random_), way(random_)));
    }
    return given;
  }

  PoseCorrection Adjust(const GivenViews& given, const std::vector<PoseMatch>& matches) const {
    PoseCorrection start;
    start.own.resize(kViews);
    return AdjustPoses(given, start, matches, rig_, options_, {}).value();
  }

  // Between neighbours, which is all that matches tell: root mean squares of metres and radians.
  std::pair<double, double> Errors(const Views& views) const {
    double way2 = 0, turn2 = 0;
    for (size_t i = 1; i < views.size(); ++i) {
      const auto between = [&](const Views& of) {
        return of[i - 1].T_world_imu.Inverse() * of[i].T_world_imu;
      };
      const RigidTransform off = between(true_).Inverse() * between(views);
      way2 += off.translation.squaredNorm();
      turn2 += std::pow(Eigen::AngleAxisd(off.rotation).angle(), 2);
    }
    const auto count = static_cast<double>(views.size() - 1);
    return {std::sqrt(way2 / count), std::sqrt(turn2 / count)};
  }

  Rig rig_;
  Views true_;
  std::mt19937 random_{7};
  ExternalPoseOptions options_;
};

TEST_F(PoseAdjustmentTest, ExactMatchesBringViewsToWhereTheyWereToEachOther) {
  const std::vector<PoseMatch> matches = Matches(0);
  const GivenViews given = Given(0.01, 0.005);
  options_.sigma_m = options_.sigma_rad = 1;  // what is given hardly counts
  const auto [way_m, turn_rad] = Errors(Corrected(given, Adjust(given, matches)));
  EXPECT_LT(way_m, 1e-4);
  EXPECT_LT(turn_rad, 1e-4);
}

TEST_F(PoseAdjustmentTest, NoiseAndAFewWildMatchesLeaveAFractionOfTheError) {
  std::vector<PoseMatch> matches = Matches(0.5);
  for (size_t i = 0; i < matches.size(); i += 10) matches[i].px.x() += 9;
  const GivenViews given = Given(0.01, 0.005);
  const auto before = Errors(given.views), after = Errors(Corrected(given, Adjust(given, matches)));
  EXPECT_LT(after.first, 0.25 * before.first);
  EXPECT_LT(after.second, 0.25 * before.second);
}

// Not as so many errors of their own, which would bend the way.
TEST_F(PoseAdjustmentTest, ABodyThatIsTurnedIsFoundAsWhatAllShare) {
  GivenViews given = Given(0, 0);
  const Vector3d turn(0.004, -0.003, 0.005);
  for (View& view : given.views) {
    view.T_world_imu.rotation = view.T_world_imu.rotation * ExpRotation(-turn);
  }
  const PoseCorrection found = Adjust(given, Matches(0.2));
  EXPECT_LT((Eigen::Map<const Vector3d>(found.common.data()) - turn).norm(), 0.1 * turn.norm());
  for (const PoseMove& own : found.own) {
    EXPECT_LT(Eigen::Map<const Vector3d>(own.data()).norm(), 0.1 * turn.norm());
  }
}

TEST_F(PoseAdjustmentTest, AClockThatIsOffIsFound) {
  GivenViews given = Given(0, 0);
  for (size_t i = 0; i < kViews; ++i) {
    const double sense = i % 2 == 0 ? 1 : -1;
    given.speeds[i] = {0.1, sense * 0.5, 0.2, 0.3, sense * 0.2, 0};
    const PoseMove& speed = given.speeds[i];
    constexpr double kLate_s = 0.01;
    given.views[i].T_world_imu =
        true_[i].T_world_imu *
        RigidTransform(ExpRotation(-kLate_s * Vector3d(speed[0], speed[1], speed[2])),
                       -kLate_s * Vector3d(speed[3], speed[4], speed[5]));
  }
  EXPECT_NEAR(Adjust(given, Matches(0.2)).clock_s, 0.01, 0.001);
}

TEST_F(PoseAdjustmentTest, WhatNoMatchTellsOfStaysAsItWasGivenButForWhatAllShare) {
  std::vector<PoseMatch> matches = Matches(0.5);
  std::erase_if(matches, [](const PoseMatch& match) { return match.from == 4 || match.to == 4; });
  const GivenViews given = Given(0.01, 0.005);
  const PoseCorrection found = Adjust(given, matches);
  for (const double value : found.own[4]) EXPECT_LT(std::abs(value), 1e-9);
  EXPECT_GT(std::abs(found.own[3][0]) + std::abs(found.own[3][3]), 1e-6);
}

TEST_F(PoseAdjustmentTest, GoesOnFromWhereItStarts) {
  const std::vector<PoseMatch> matches = Matches(0.5);
  const GivenViews given = Given(0.01, 0.02);
  const PoseCorrection there = Adjust(given, matches);
  options_.max_iterations = 1;
  const auto distance_m = [&](const PoseCorrection& other) {
    const Views a = Corrected(given, there), b = Corrected(given, other);
    double sum_m = 0;
    for (size_t i = 0; i < kViews; ++i) {
      sum_m += (a[i].T_world_imu.translation - b[i].T_world_imu.translation).norm();
    }
    return sum_m;
  };
  const PoseCorrection from_there = *AdjustPoses(given, there, matches, rig_, options_, {});
  EXPECT_LT(distance_m(from_there), 0.2 * distance_m(Adjust(given, matches)));
}

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

  std::optional<AdjustedViews> AdjustGiven(const Views& views) const {
    return AdjustGivenViews({views, std::vector<PoseMove>(views.size())}, room_, options_);
  }

  static OdometryRun RunOf(const Views& views) {
    OdometryRun run;
    for (const View& view : views) {
      run.keyframes.push_back({0, view.segment, view.stamp_ns, view.T_world_imu, {}, {}});
    }
    return run;
  }

  static const RoomViews& Room() {
    static const RoomViews room(2.4, 0.25, 3);
    return room;
  }
  const RoomViews& room_ = Room();
  ExternalPoseOptions options_;
};

// As keyframes of a run they are moved alike, unless that is not wanted.
TEST_F(GivenPosesTest, TurnedViewsAreTurnedBackOnAnyNumberOfThreads) {
  const Views given = Turned();
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const auto adjusted = AdjustGiven(given);
  OdometryRun run = RunOf(given);
  options_.adjust = false;
  EXPECT_FALSE(AdjustExternalPoses(room_, options_, &run));
  EXPECT_EQ(run.keyframes[2].T_world_imu.rotation.coeffs(), given[2].T_world_imu.rotation.coeffs());
  options_.adjust = true;
  cv::setNumThreads(3);
  EXPECT_TRUE(AdjustExternalPoses(room_, options_, &run));
  cv::setNumThreads(threads);
  ASSERT_TRUE(adjusted);
  EXPECT_GT(adjusted->figures.given_off_px, 1);
  EXPECT_LT(adjusted->figures.off_px, 0.3);
  EXPECT_LT(TurnOff(adjusted->views), 0.25 * TurnOff(given));
  EXPECT_GT(adjusted->figures.pairs, 5);
  EXPECT_GT(adjusted->figures.turned_rad, 0.0005);
  for (size_t i = 0; i < given.size(); ++i) {
    const RigidTransform &a = adjusted->views[i].T_world_imu, &b = run.keyframes[i].T_world_imu;
    EXPECT_EQ(a.translation, b.translation);
    EXPECT_EQ(a.rotation.coeffs(), b.rotation.coeffs());
  }
}

TEST_F(GivenPosesTest, TruePosesAndThoseThatAreNotSeenTwiceStay) {
  EXPECT_FALSE(AdjustGiven(room_.views()));
  EXPECT_FALSE(AdjustGiven({room_.views().front()}));
  Views apart = room_.views();
  for (size_t i = 0; i < apart.size(); ++i) {
    apart[i].T_world_imu.translation.x() += 100.0 * static_cast<double>(i);
  }
  EXPECT_FALSE(AdjustGiven(apart));
}

// States that the way and its turns are told by, as a clock has them that is 40 ms off; those
// between keyframes are corrected where the rig moves, and stay where it stands.
TEST_F(GivenPosesTest, AClockThatIsOffIsMendedInStatesToo) {
  const RigidTransform first = room_.views()[0].T_world_imu;
  const auto pose_at = [&](double s) {  // turns while it moves, and stands from 1 s on
    const double moving_s = std::min(s, 1.0);
    return first * RigidTransform(ExpRotation({0, 0, 0.8 * moving_s}), {0.4 * moving_s, 0, 0});
  };
  std::vector<OnlineState> states;
  for (int i = 0; i <= 40; ++i) {
    states.push_back({.stamp_ns = 50'000'000LL * i, .T_world_imu = pose_at(0.05 * i)});
  }
  const std::vector<OnlineState> corrected = CorrectedStates(states, {{}, 0.04, {}});
  for (const int i : {0, 7, 15}) {
    const RigidTransform truth = pose_at(0.05 * i + 0.04);
    EXPECT_LT((corrected[i].T_world_imu.translation - truth.translation).norm(), 5e-4) << i;
    EXPECT_LT(corrected[i].T_world_imu.rotation.angularDistance(truth.rotation), 1e-3) << i;
  }
  EXPECT_EQ(corrected[35].T_world_imu.translation, states[35].T_world_imu.translation);
}

TEST_F(GivenPosesTest, ARunThatIsInterruptedStaysAsItWas) {
  OdometryRun run = RunOf(Turned());
  EXPECT_FALSE(AdjustExternalPoses(room_, options_, &run, Progress([](double done) {
                                     return done < 0.8;  // in the second round
                                   })));
  EXPECT_EQ(run.keyframes[2].T_world_imu.rotation.coeffs(),
            Turned()[2].T_world_imu.rotation.coeffs());
}

}  // namespace
}  // namespace slcmap
