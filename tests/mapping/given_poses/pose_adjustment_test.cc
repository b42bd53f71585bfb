#include "mapping/given_poses/pose_adjustment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <utility>

#include "data/error.h"
#include "data/rigid_transform.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

// Views along a wall that is full of points, at true poses, with what is found of the points in the
// views before and after.
class PoseAdjustmentTest : public ::testing::Test {
 protected:
  static constexpr size_t kViews = 8;

  PoseAdjustmentTest() {
    Camera camera;
    camera.width_px = 640;
    camera.height_px = 480;
    camera.fx_px = camera.fy_px = 400;
    camera.cx_px = 320;
    camera.cy_px = 240;
    rig_.cameras = {camera, camera};
    const Eigen::Quaterniond R_imu_camera = ExpRotation({0.1, -0.2, 1.5});
    rig_.T_imu_camera = {RigidTransform(R_imu_camera, {0.02, -0.05, 0.01}),
                         RigidTransform(R_imu_camera, {0.02, 0.05, 0.01})};
    for (size_t i = 0; i < kViews; ++i) {
      const double x = static_cast<double>(i);
      const RigidTransform T_world_camera(ExpRotation({0.02 * x, 0.03 * x, -0.02 * x}),
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

  Views Given(double sigma_m, double sigma_rad) {
    std::normal_distribution<double> way(0, sigma_m), turn(0, sigma_rad);
    Views given = true_;
    for (View& view : given) {
      const Vector3d w(turn(random_), turn(random_), turn(random_));
      view.T_world_imu =
          view.T_world_imu *
          RigidTransform(ExpRotation(w), Vector3d(way(random_), way(random_), way(random_)));
    }
    return given;
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
  GivenPoseOptions options_;
};

TEST_F(PoseAdjustmentTest, ExactMatchesBringViewsToWhereTheyWereToEachOther) {
  const std::vector<PoseMatch> matches = Matches(0);
  const Views given = Given(0.01, 0.005);
  options_.sigma_m = options_.sigma_rad = 1;  // what is given hardly counts
  const Views adjusted = AdjustViews(given, given, matches, rig_, options_, {});
  const auto [way_m, turn_rad] = Errors(adjusted);
  EXPECT_LT(way_m, 1e-4);
  EXPECT_LT(turn_rad, 1e-4);
}

TEST_F(PoseAdjustmentTest, NoiseAndAFewWildMatchesLeaveAFractionOfTheError) {
  std::vector<PoseMatch> matches = Matches(0.5);
  for (size_t i = 0; i < matches.size(); i += 10) matches[i].px.x() += 9;
  const Views given = Given(0.01, 0.005);
  const Views adjusted = AdjustViews(given, given, matches, rig_, options_, {});
  const auto before = Errors(given), after = Errors(adjusted);
  EXPECT_LT(after.first, 0.25 * before.first);
  EXPECT_LT(after.second, 0.25 * before.second);
}

TEST_F(PoseAdjustmentTest, WhatNoMatchTellsOfStaysAsItWasGiven) {
  std::vector<PoseMatch> matches = Matches(0.5);
  std::erase_if(matches, [](const PoseMatch& match) { return match.from == 4 || match.to == 4; });
  const Views given = Given(0.01, 0.005);
  const Views adjusted = AdjustViews(given, given, matches, rig_, options_, {});
  const RigidTransform move = given[4].T_world_imu.Inverse() * adjusted[4].T_world_imu;
  EXPECT_LT(move.translation.norm(), 1e-9);
  EXPECT_LT(Eigen::AngleAxisd(move.rotation).angle(), 1e-9);
}

TEST_F(PoseAdjustmentTest, GoesOnFromWhereItStarts) {
  const std::vector<PoseMatch> matches = Matches(0.5);
  const Views given = Given(0.01, 0.005);
  const Views once = AdjustViews(given, given, matches, rig_, options_, {});
  const Views twice = AdjustViews(given, once, matches, rig_, options_, {});
  for (size_t i = 0; i < kViews; ++i) {
    EXPECT_LT((once[i].T_world_imu.translation - twice[i].T_world_imu.translation).norm(), 1e-3);
  }
}

TEST_F(PoseAdjustmentTest, EndsWhenAsked) {
  const Views given = Given(0.01, 0.005);
  const Progress stop([](double) { return false; });
  EXPECT_THROW(AdjustViews(given, given, Matches(0), rig_, options_, stop), StoppedError);
}

}  // namespace
}  // namespace slcmap
