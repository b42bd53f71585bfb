#include "odometry/structure/slope_detector.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "data/core/math.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr double kSigma_rad = 0.005;  // of each line's direction
const SlopeBlock kStairs = {0.4, 31 * kDegree};

class SlopeDetectorTest : public ::testing::Test {
 protected:
  double Normal() { return std::normal_distribution<double>()(random_); }

  // A line of a direction through a place, as well known as claimed.
  FreeLine Measured(const Vector3d& direction, const Vector3d& middle_world) {
    const Vector3d d = direction.normalized();
    const Vector3d off = kSigma_rad * Vector3d(Normal(), Normal(), Normal());
    FreeLine line;
    line.id = next_id_++;
    line.middle_world = middle_world;
    line.direction_world = (d + off - d * d.dot(off)).normalized();
    if (next_id_ % 2 == 0) line.direction_world *= -1;  // which way a line runs means nothing
    line.direction_covariance_rad2 =
        kSigma_rad * kSigma_rad * (Eigen::Matrix3d::Identity() - d * d.transpose());
    line.length_m = 2;
    return line;
  }

  // Lines beside each other, so far apart.
  std::vector<FreeLine> Bundle(const Vector3d& direction, int count, double apart_m) {
    std::vector<FreeLine> lines;
    const Vector3d aside = direction.cross(Vector3d::UnitZ()).normalized();
    for (int i = 0; i < count; ++i) {
      lines.push_back(Measured(direction, Vector3d(3, 1, 1) + i * apart_m * aside));
    }
    return lines;
  }

  std::vector<FreeLine> Clutter(int count) {
    std::vector<FreeLine> lines;
    for (int i = 0; i < count; ++i) {
      lines.push_back(
          Measured({Normal(), Normal(), Normal()}, 3 * Vector3d(Normal(), Normal(), Normal())));
    }
    return lines;
  }

  std::optional<SlopeEvidence> Find(const std::vector<FreeLine>& lines) {
    return detector_.AddKeyframe(lines, axes_, known_);
  }

  std::mt19937 random_{5};
  int64_t next_id_ = 0;
  std::vector<Vector3d> axes_ = {Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()};
  std::vector<SlopeBlock> known_;
  SlopeDetector detector_;
};

TEST_F(SlopeDetectorTest, FindsWhatLinesOfSeveralObjectsShareAmongClutter) {
  std::vector<FreeLine> lines = Bundle(SlopeDirection(kStairs.data()), 6, 0.5);
  for (const FreeLine& line : Clutter(12)) lines.push_back(line);
  const auto found = Find(lines);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->lines, 6);
  EXPECT_EQ(found->objects, 6);
  // Each line may deviate by as much as it is uncertain.
  EXPECT_NEAR(found->sigma_rad, std::sqrt(2.0 / 6) * kSigma_rad, 1e-4);
  EXPECT_NEAR(found->angles_rad[1], kStairs[1], 3 * found->sigma_rad);
  EXPECT_NEAR(found->angles_rad[0], kStairs[0], 3 * found->sigma_rad / std::cos(kStairs[1]));
}

TEST_F(SlopeDetectorTest, FindsNoneInClutter) {
  for (int i = 0; i < 60; ++i) EXPECT_FALSE(Find(Clutter(8)));
}

// The edges of a crate that lies askew are parallel too.
TEST_F(SlopeDetectorTest, EdgesBesideEachOtherAreOneObject) {
  EXPECT_FALSE(Find(Bundle(SlopeDirection(kStairs.data()), 12, 0.02)));
  EXPECT_EQ(detector_.Best(axes_, known_)->objects, 1);
}

TEST_F(SlopeDetectorTest, ShortLinesDoNotVote) {
  std::vector<FreeLine> lines = Bundle(SlopeDirection(kStairs.data()), 6, 0.5);
  for (FreeLine& line : lines) line.length_m = 0.6;
  EXPECT_FALSE(Find(lines));
}

TEST_F(SlopeDetectorTest, LevelAndVerticalLinesAndThoseAlongAxesAreNoSlopesButARampIs) {
  for (const double elevation_deg : {0.0, 1.0, 89.0, 90.0}) {
    const SlopeBlock level = {0.4, elevation_deg * kDegree};
    EXPECT_FALSE(Find(Bundle(SlopeDirection(level.data()), 8, 0.5))) << elevation_deg;
    detector_.Reset();
  }
  const SlopeBlock ramp = {0, 6 * kDegree};  // above an axis
  const auto found = Find(Bundle(SlopeDirection(ramp.data()), 8, 0.5));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->angles_rad[1], ramp[1], 3 * found->sigma_rad);
  detector_.Reset();
  axes_.push_back(SlopeDirection(kStairs.data()));
  EXPECT_FALSE(Find(Bundle(SlopeDirection(kStairs.data()), 8, 0.5)));
}

TEST_F(SlopeDetectorTest, AKnownSlopeIsNotFoundAgainButAnotherOneIs) {
  known_.push_back(kStairs);
  EXPECT_FALSE(Find(Bundle(SlopeDirection(kStairs.data()), 8, 0.5)));
  const SlopeBlock roof = {kStairs[0] + M_PI / 2, 40 * kDegree};
  EXPECT_TRUE(Find(Bundle(SlopeDirection(roof.data()), 8, 0.5)));
}

TEST_F(SlopeDetectorTest, LinesOfSeveralKeyframesAreTakenTogetherUntilTheyAreForgotten) {
  const std::vector<FreeLine> lines = Bundle(SlopeDirection(kStairs.data()), 6, 0.5);
  for (size_t i = 0; i < 4; ++i) EXPECT_FALSE(Find({lines[i]}));
  EXPECT_TRUE(Find({lines[4]}));
  for (int i = 0; i < 30; ++i) Find({});
  EXPECT_FALSE(Find({lines[5]}));
}

}  // namespace
}  // namespace slcmap
