#include "data/check/row_alignment.h"

#include <gtest/gtest.h>

#include <random>

#include "data/core/math.h"

namespace slcmap {
namespace {

constexpr double kFocal_px = 450;

RigidTransform LeftRight() { return {Eigen::Quaterniond::Identity(), {0.11, 0.002, -0.001}}; }

// Rays of points before the rig, some of them wrong, as seen by a right camera that is turned more
// than LeftRight() says.
std::vector<RayPair> Matches(const Eigen::Vector3d& turn_rad, double noise_px) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> across(-0.7, 0.7), depth(1, 8);
  std::normal_distribution<double> noise(0, noise_px / kFocal_px);
  const RigidTransform T_left_right = {LeftRight().rotation * ExpRotation(turn_rad),
                                       LeftRight().translation};
  std::vector<RayPair> matches;
  for (int i = 0; i < 1500; ++i) {
    const double z = depth(random);
    const Eigen::Vector3d p(across(random) * z, 0.6 * across(random) * z, z);
    const Eigen::Vector3d wrong(0, i % 10 == 0 ? across(random) : 0, 0);
    const Eigen::Vector3d error(noise(random), noise(random), 0);
    matches.push_back({(p / z).normalized(),
                       ((T_left_right.Inverse() * p).normalized() + error + wrong).normalized()});
  }
  return matches;
}

TEST(RowAlignment, FindsTheTurnOfTheRightCamera) {
  for (const Eigen::Vector3d& turn :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.05, 0, -0.02), Eigen::Vector3d(-3, 0, 1)}) {
    const RowAlignment found = AlignRows(Matches(turn * kDegree, 0.2), LeftRight(), kFocal_px);
    EXPECT_NEAR(found.turn_rad.x() / kDegree, turn.x(), 0.005);
    EXPECT_NEAR(found.turn_rad.z() / kDegree, turn.z(), 0.01);
    EXPECT_LT(std::abs(found.turn_rad.x() - turn.x() * kDegree), 4 * found.turn_sigma_rad.x());
    EXPECT_LT(found.mended_rows_px, 0.25);
    EXPECT_NEAR(found.agreeing_share, 0.9, 0.05);
  }
}

TEST(RowAlignment, TurnsAboutYOnlyWhereThatIsClear) {
  const RowAlignment small =
      AlignRows(Matches(Eigen::Vector3d(0, 0.03, 0) * kDegree, 0.2), LeftRight(), kFocal_px);
  EXPECT_NEAR(small.turn_rad.y(), 0, 1e-5);
  const RowAlignment large =
      AlignRows(Matches(Eigen::Vector3d(0.1, 0.5, 0) * kDegree, 0.2), LeftRight(), kFocal_px);
  EXPECT_NEAR(large.turn_rad.y() / kDegree, 0.5, 0.1);
  EXPECT_NEAR(large.turn_rad.x() / kDegree, 0.1, 0.01);
}

// The same features as a right camera shows them whose focal length is told as another one.
std::vector<RayPair> ToldLonger(std::vector<RayPair> matches, const Camera& told, double share) {
  Camera is = told;
  is.fx_px /= 1 + share;
  is.fy_px /= 1 + share;
  for (RayPair& rays : matches)
    rays.second = told.Unproject(*is.Project(rays.second))->normalized();
  return matches;
}

Camera RightCamera() {
  Camera camera;
  camera.width_px = 752;
  camera.height_px = 480;
  camera.fx_px = camera.fy_px = kFocal_px;
  camera.cx_px = 376;
  camera.cy_px = 240;
  return camera;
}

TEST(RowAlignment, FindsTheFocalLengthOfTheRightCameraBesideItsTurn) {
  const Camera right = RightCamera();
  for (const double share : {0.004, -0.01, 0.0003, 0.0}) {
    const std::vector<RayPair> matches =
        ToldLonger(Matches(Eigen::Vector3d(0.05, 0, -0.02) * kDegree, 0.2), right, share);
    const RowAlignment found =
        AlignRows(matches, LeftRight(), kFocal_px, LongerRays(matches, right));
    // What is too little to be clear is not told.
    EXPECT_NEAR(found.right_focal, std::abs(share) < 0.001 ? 0 : 1 / (1 + share) - 1, 2e-4);
    EXPECT_NEAR(found.turn_rad.x() / kDegree, 0.05, 0.005) << share;
    EXPECT_NEAR(found.turn_rad.z() / kDegree, -0.02, 0.01) << share;
    EXPECT_LT(found.mended_rows_px, 0.25) << share;
    // Without the rays that tell of it, rows stay as far apart as it has them.
    if (std::abs(share) > 0.005) {
      EXPECT_GT(AlignRows(matches, LeftRight(), kFocal_px).mended_rows_px, 0.4);
    }
  }
}

// Pairs of a rig that hardly moves show the same features with the same errors.
TEST(RowAlignment, IsNotSureOfATurnAboutYBecauseAViewIsRepeated) {
  for (int view = 0; view < 12; ++view) {
    const std::vector<RayPair> all = Matches(Eigen::Vector3d::Zero(), 0.3);
    std::vector<RayPair> repeated;
    for (int i = 0; i < 24; ++i) {
      repeated.insert(repeated.end(), all.begin() + 30 * view, all.begin() + 30 * (view + 1));
    }
    const RowAlignment found = AlignRows(repeated, LeftRight(), kFocal_px);
    EXPECT_LT(std::abs(found.turn_rad.y()), 1e-3 * kDegree + 1e-5) << view;
  }
}

TEST(RowAlignment, SaysNothingWithoutMatches) {
  EXPECT_EQ(AlignRows({}, LeftRight(), kFocal_px).matches, 0);
}

}  // namespace
}  // namespace slcmap
