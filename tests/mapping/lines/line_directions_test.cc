#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "data/core/error.h"
#include "mapping/lines/guided_pass.h"
#include "mapping/lines/line_fit.h"
#include "mapping/lines/line_store.h"
#include "mapping/lines/options.h"

namespace slcmap {
namespace {

DirectedLine Level(double heading_deg, double length_m) {
  const double angle = heading_deg * M_PI / 180;
  return {{std::cos(angle), std::sin(angle), 0}, length_m, 0.002};
}

double Heading_deg(const BuildingAxis& axis) {
  return std::atan2(axis.direction_world.y(), axis.direction_world.x()) * 180 / M_PI;
}

TEST(BuildingAxes, OfABuildingAreThoseThatItsLinesShare) {
  const std::vector<DirectedLine> lines = {
      Level(20, 6), Level(110, 4), Level(-160, 3), Level(55, 1), {{0, 0, -1}, 8, 0.001}};
  const auto axes = FindAxes(lines);
  ASSERT_EQ(axes.size(), 3u);
  EXPECT_EQ(axes[0].axis, LineAxis::kVertical);
  EXPECT_EQ(axes[1].axis, LineAxis::kX);
  EXPECT_NEAR(Heading_deg(axes[1]), 20, 0.1);
  EXPECT_NEAR(Heading_deg(axes[2]), 110, 0.1);
}

TEST(BuildingAxes, OfAWingTurnedByTwelveDegreesAreItsOwn) {
  const auto axes = FindAxes({Level(0, 12), Level(90, 9), Level(12, 8), Level(102, 5)});
  ASSERT_EQ(axes.size(), 5u);
  EXPECT_NEAR(Heading_deg(axes[1]), 0, 0.1);
  EXPECT_NEAR(Heading_deg(axes[3]), 12, 0.1);
  EXPECT_EQ(axes[3].world, 1);
}

TEST(BuildingAxes, OfAFurnishedRoomAreNotWhatAnyHeadingHas) {
  std::vector<DirectedLine> lines = {Level(20, 60), Level(44, 40)};
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any_deg(0, 180);
  for (int i = 0; i < 800; ++i) lines.push_back(Level(any_deg(random), 1));
  const auto axes = FindAxes(lines);
  ASSERT_EQ(axes.size(), 5u);
  EXPECT_NEAR(Heading_deg(axes[1]), 20, 0.2);
  EXPECT_NEAR(Heading_deg(axes[3]), 44, 0.2);
}

TEST(BuildingAxes, AVerticalThatLeansIsThatOfTheLines) {
  const Eigen::Vector3d leaning = Eigen::Vector3d(0.03, 0, 1).normalized();
  const auto axes = FindAxes({{leaning, 9, 0.001}, {-leaning, 9, 0.001}});
  ASSERT_EQ(axes.size(), 1u);
  EXPECT_LT(axes[0].direction_world.cross(leaning).norm(), 1e-9);
}

TEST(BuildingAxes, WithoutLinesAreTheVerticalAlone) {
  const auto axes = FindAxes({});
  ASSERT_EQ(axes.size(), 1u);
  EXPECT_EQ(axes[0].direction_world, Eigen::Vector3d::UnitZ());
}

TEST(BuildingAxes, OfARunLeaveOutWhatWasWithdrawn) {
  OdometryRun run;
  run.line_deviation_rad = 0.003;
  run.manhattan_worlds = {{.heading_rad = 0.1}, {.heading_rad = 0.5, .withdrawn = true}};
  const auto axes = AxesOfRun(run, 0.0005);
  ASSERT_EQ(axes.size(), 3u);
  EXPECT_EQ(axes[1].world, 0);
  // Lines may be farther off than the run has learned.
  EXPECT_NEAR(axes[1].sigma_rad, 1.4 * 0.003, 1e-12);
  run.line_deviation_rad = 0;
  EXPECT_EQ(AxesOfRun(run, 0.0005)[1].sigma_rad, 0.0005);
}

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
      (along + ComputeAcross(along) * (places / (places + prior) * off_rad)).normalized();
  line.fit.line = line.line;
  line.fit.across = ComputeAcross(line.line.direction_world);
  line.fit.places_information.topLeftCorner<2, 2>() = 1e6 * Eigen::Matrix2d::Identity();
  line.fit.places_information.bottomRightCorner<2, 2>() = places * Eigen::Matrix2d::Identity();
  return line;
}

Eigen::Vector2d AcrossAxis(const DirectionPrior& prior, const Eigen::Vector3d& axis_world) {
  return ComputeAcross(axis_world).transpose() * prior.axis_world;
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
          AcrossAxis(*priors[i], kAxes[0].direction_world) - off_rad.row(i).transpose();
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
  EXPECT_GT(AcrossAxis(*priors[12], kAxes[0].direction_world).x(), 0.001);
  EXPECT_LT(AcrossAxis(*priors[13], kAxes[0].direction_world).x(), -0.001);
  EXPECT_LT(priors[12]->sigma_rad, 0.8 * kSigma_rad);
  // Alone of its axis.
  EXPECT_NEAR(AcrossAxis(*priors[14], kAxes[1].direction_world).norm(), 0, 1e-12);
  EXPECT_NEAR(priors[14]->sigma_rad, kSigma_rad, 1e-12);
}

// Images know a line's direction in one way across it alone, and not apart from its place.
TEST_F(NeighbourDirections, AreOfWhatPlacesTellAndOfNothingElse) {
  const Eigen::Vector3d& along = kAxes[0].direction_world;
  const double prior = 1 / (kSigma_rad * kSigma_rad), strong = 1e8, weak = 1;
  const Eigen::Vector3d known_way = Eigen::Vector3d(0.6, 0.8, 0);
  std::vector<TrackedLine> lines;
  for (int i = 0; i < 12; ++i) {
    TrackedLine line = LineOff(0, {0.05 * i, 0, 0}, {0, 0}, 1);
    line.fit.across = ComputeAcross(along) * Eigen::Rotation2D(0.7).toRotationMatrix();
    const Eigen::Vector2d known = line.fit.across.transpose() * known_way;
    const Eigen::Vector2d unknown(-known.y(), known.x());
    const Eigen::Matrix2d of_direction =
        strong * known * known.transpose() + weak * unknown * unknown.transpose();
    // Seen half a metre from its point, so that place and direction are known together.
    Eigen::Matrix4d& information = line.fit.places_information;
    information.topLeftCorner<2, 2>() = 4 * of_direction;
    information.topRightCorner<2, 2>() = 2 * of_direction;
    information.bottomLeftCorner<2, 2>() = 2 * of_direction;
    information.bottomRightCorner<2, 2>() = 2 * of_direction;
    Eigen::Vector4d true_off;
    true_off << 0.001, -0.002, line.fit.across.transpose() * (0.003 * known_way);
    Eigen::Matrix4d with_prior = information;
    with_prior.bottomRightCorner<2, 2>() += prior * Eigen::Matrix2d::Identity();
    with_prior.topLeftCorner<2, 2>() += 1e-6 * Eigen::Matrix2d::Identity();
    const Eigen::Vector4d fitted = with_prior.ldlt().solve(information * true_off);
    line.line.direction_world = (along + line.fit.across * fitted.tail<2>()).normalized();
    lines.push_back(line);
  }
  lines.push_back(LineOff(0, {0.3, 0.1, 0}, {0, 0}, 1));
  const Eigen::Vector3d predicted = PriorsByNeighbours(lines, kAxes, options_).back()->axis_world;
  EXPECT_GT(predicted.dot(known_way), 0.0015);
  EXPECT_LT(predicted.dot(known_way), 0.003);
  EXPECT_NEAR(predicted.dot(Eigen::Vector3d(-0.8, 0.6, 0)), 0, 1e-4);
}

TEST_F(NeighbourDirections, AreOfTheNearestAlone) {
  const NeighbourOptions few{.max_neighbours = 6};
  std::vector<TrackedLine> lines = {LineOff(0, {0.3, 0.1, 0}, {0, 0}, 1)};
  for (int i = 0; i < 6; ++i) lines.push_back(LineOff(0, {0.1 * i, 0, 0}, {0.003, 0}, 0.001));
  const auto before = PriorsByNeighbours(lines, kAxes, few);
  for (int i = 0; i < 6; ++i) lines.push_back(LineOff(0, {4.0 + i, 0, 0}, {-0.003, 0}, 0.001));
  const auto after = PriorsByNeighbours(lines, kAxes, few);
  EXPECT_EQ(before[0]->axis_world, after[0]->axis_world);
  EXPECT_NE(after[0]->axis_world, PriorsByNeighbours(lines, kAxes, options_)[0]->axis_world);
}

TEST_F(NeighbourDirections, AreNotOfAnotherSegmentOfTheRun) {
  std::vector<TrackedLine> lines = {LineOff(0, {0.3, 0.1, 0}, {0, 0}, 1)};
  for (int i = 0; i < 6; ++i) {
    lines.push_back(LineOff(0, {0.1 * i, 0, 0}, {0.003, 0}, 0.001));
    lines.back().segment = 1;
  }
  EXPECT_EQ(PriorsByNeighbours(lines, kAxes, options_)[0]->axis_world, kAxes[0].direction_world);
}

TEST_F(NeighbourDirections, SharesAreNoMoreThanAll) {
  MapLineOptions options;
  options.neighbours = {.building_share = 0.7, .shared_share = 0.3};
  options.Check();
  options.neighbours.shared_share = 0.4;
  EXPECT_THROW(options.Check(), ConfigError);
}

TEST_F(NeighbourDirections, DoNotDependOnTheSenseOfLines) {
  std::vector<TrackedLine> lines;
  for (int i = 0; i < 5; ++i) lines.push_back(LineOff(0, {0.5 * i, 0, 0}, {0.004, 0.001}, 0.001));
  const auto one_way = PriorsByNeighbours(lines, kAxes, options_);
  lines[2].line.direction_world = -lines[2].line.direction_world;
  lines[2].fit.across = ComputeAcross(lines[2].line.direction_world);
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
