#include "mapping/lines/neighbour_directions.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "mapping/lines/across.h"

namespace slcmap {
namespace {

constexpr double kSigma_rad = 0.004;

BuildingAxis Axis(LineAxis axis, const Eigen::Vector3d& direction_world) {
  return {axis, axis == LineAxis::kVertical ? -1 : 0, -1, direction_world, kSigma_rad};
}

const std::vector<BuildingAxis> kAxes = {Axis(LineAxis::kVertical, Eigen::Vector3d::UnitZ()),
                                         Axis(LineAxis::kX, Eigen::Vector3d::UnitX())};

// A line whose places, known to noise_rad, have it so far off its axis; fitted with the prior that
// it is along it.
TrackedLine LineOff(int axis, const Eigen::Vector3d& middle_world, const Eigen::Vector2d& off_rad,
                    double noise_rad) {
  const Eigen::Vector3d& along = kAxes[axis].direction_world;
  const double places = 1 / (noise_rad * noise_rad), prior = 1 / (kSigma_rad * kSigma_rad);
  TrackedLine line;
  line.axis = axis;
  line.line.point_world = middle_world;
  line.line.direction_world =
      (along + AcrossOf(along) * (places / (places + prior) * off_rad)).normalized();
  line.fit.line = line.line;
  line.fit.across = AcrossOf(line.line.direction_world);
  line.fit.places_information.topLeftCorner<2, 2>() = 1e6 * Eigen::Matrix2d::Identity();
  line.fit.places_information.bottomRightCorner<2, 2>() = places * Eigen::Matrix2d::Identity();
  return line;
}

Eigen::Vector2d OffAxis(const DirectionPrior& prior, const Eigen::Vector3d& axis_world) {
  return AcrossOf(axis_world).transpose() * prior.axis_world;
}

class NeighbourDirections : public ::testing::Test {
 protected:
  Eigen::Vector2d Normal2() { return {normal_(random_), normal_(random_)}; }

  const NeighbourOptions options_;
  std::mt19937 random_{1};
  std::normal_distribution<double> normal_{0, 1};
};

// Lines drawn from the model itself, of which each is foretold by all others.
TEST_F(NeighbourDirections, ErrAsTheyAreSaidTo) {
  constexpr int kBuildings = 60, kLines = 25;
  constexpr double kNoise_rad = 0.002;
  double squared = 0, sigma_rad = 0;
  for (int building = 0; building < kBuildings; ++building) {
    std::vector<Eigen::Vector3d> middles;
    for (int i = 0; i < kLines; ++i) {
      middles.push_back(2 * Eigen::Vector3d(normal_(random_), normal_(random_), 0));
    }
    Eigen::MatrixXd shared(kLines, kLines);
    for (int i = 0; i < kLines; ++i) {
      for (int k = 0; k < kLines; ++k) {
        shared(i, k) =
            options_.building_share +
            options_.shared_share * std::exp(-(middles[i] - middles[k]).norm() / options_.reach_m);
      }
      shared(i, i) += 1 - options_.building_share - options_.shared_share;
    }
    const Eigen::MatrixXd root = kSigma_rad * Eigen::MatrixXd(shared.llt().matrixL());
    Eigen::MatrixXd drawn(kLines, 2);
    for (int i = 0; i < kLines; ++i) drawn.row(i) = Normal2().transpose();
    const Eigen::MatrixXd off_rad = root * drawn;
    std::vector<TrackedLine> lines;
    for (int i = 0; i < kLines; ++i) {
      const Eigen::Vector2d seen = off_rad.row(i).transpose() + kNoise_rad * Normal2();
      lines.push_back(LineOff(0, middles[i], seen, kNoise_rad));
    }
    const auto priors = PriorsByNeighbours(lines, kAxes, options_);
    for (int i = 0; i < kLines; ++i) {
      ASSERT_TRUE(priors[i]);
      EXPECT_FALSE(priors[i]->is_across);
      const Eigen::Vector2d error =
          OffAxis(*priors[i], kAxes[0].direction_world) - off_rad.row(i).transpose();
      squared += error.squaredNorm() / (priors[i]->sigma_rad * priors[i]->sigma_rad);
      sigma_rad += priors[i]->sigma_rad;
    }
  }
  // What is far from the axis counts less, which costs a little.
  EXPECT_NEAR(squared / (2 * kBuildings * kLines), 1, 0.15);
  EXPECT_LT(sigma_rad / (kBuildings * kLines), 0.75 * kSigma_rad);
}

TEST_F(NeighbourDirections, FollowThoseNearbyAndOfTheSameAxis) {
  const Eigen::Vector2d here(0.003, 0), there(-0.003, 0);
  std::vector<TrackedLine> lines;
  for (int i = 0; i < 6; ++i) {
    lines.push_back(LineOff(0, {0.1 * i, 0, 0}, here, 0.001));
    lines.push_back(LineOff(0, {20 + 0.1 * i, 0, 0}, there, 0.001));
  }
  lines.push_back(LineOff(0, {0.3, 0.1, 0}, {0, 0}, 1));  // of which its places tell nothing
  lines.push_back(LineOff(0, {20.3, 0.1, 0}, {0, 0}, 1));
  lines.push_back(LineOff(1, {0.3, 0.1, 0}, {0, 0}, 1));
  const auto priors = PriorsByNeighbours(lines, kAxes, options_);
  EXPECT_GT(OffAxis(*priors[12], kAxes[0].direction_world).x(), 0.001);
  EXPECT_LT(OffAxis(*priors[13], kAxes[0].direction_world).x(), -0.001);
  EXPECT_LT(priors[12]->sigma_rad, 0.8 * kSigma_rad);
  // Alone of its axis.
  EXPECT_NEAR(OffAxis(*priors[14], kAxes[1].direction_world).norm(), 0, 1e-12);
  EXPECT_NEAR(priors[14]->sigma_rad, kSigma_rad, 1e-12);
}

TEST_F(NeighbourDirections, DoNotDependOnTheSenseOfLines) {
  std::vector<TrackedLine> lines;
  for (int i = 0; i < 5; ++i) lines.push_back(LineOff(0, {0.5 * i, 0, 0}, {0.004, 0.001}, 0.001));
  const auto one_way = PriorsByNeighbours(lines, kAxes, options_);
  lines[2].line.direction_world = -lines[2].line.direction_world;
  lines[2].fit.across = AcrossOf(lines[2].line.direction_world);
  const auto other_way = PriorsByNeighbours(lines, kAxes, options_);
  for (int i = 0; i < 5; ++i) {
    EXPECT_LT((one_way[i]->axis_world - other_way[i]->axis_world).norm(), 1e-9) << i;
  }
}

TEST_F(NeighbourDirections, AreHardlyMovedByWhatIsOfNoAxis) {
  std::vector<TrackedLine> lines;
  for (int i = 0; i < 8; ++i) lines.push_back(LineOff(0, {0.5 * i, 0, 0}, {0.002, 0}, 0.001));
  const auto before = PriorsByNeighbours(lines, kAxes, options_);
  lines.push_back(LineOff(0, {1.6, 0, 0}, {0.06, 0.06}, 0.001));
  const auto after = PriorsByNeighbours(lines, kAxes, options_);
  for (int i = 0; i < 8; ++i) {
    EXPECT_LT((before[i]->axis_world - after[i]->axis_world).norm(), 0.0007) << i;
  }
}

TEST_F(NeighbourDirections, AreNoneOfLinesWithoutAxis) {
  std::vector<TrackedLine> lines = {LineOff(0, {0, 0, 0}, {0, 0}, 0.001)};
  lines[0].axis = -1;
  const auto priors = PriorsByNeighbours(lines, kAxes, options_);
  ASSERT_EQ(priors.size(), 1u);
  EXPECT_FALSE(priors[0]);
}

}  // namespace
}  // namespace slcmap
