#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "data/core/math.h"
#include "odometry/structure/building_deviation.h"
#include "odometry/structure/points_on_lines.h"
#include "odometry/structure/slope_detector.h"

namespace slcmap {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr double kDisparity_px = 30;

PointObservation Point(int64_t id, double x, double y, double disparity_px = kDisparity_px) {
  return {id, {x, y}, Eigen::Vector2d(x - disparity_px, y)};
}

LineObservation Line(int64_t id, const Eigen::Vector2d& start, const Eigen::Vector2d& end) {
  const Eigen::Vector2d d(kDisparity_px, 0);
  return {id, {start, end}, LineSegment{start - d, end - d}};
}

const LineObservation kSlanted = Line(7, {100, 100}, {300, 300});
const PointOnLine kPair = {1, 7};

class PointsOnLinesTest : public ::testing::Test {
 protected:
  const std::set<PointOnLine>& Add(const std::vector<PointObservation>& points,
                                   const std::vector<LineObservation>& lines, int keyframes = 1) {
    for (int i = 0; i < keyframes; ++i) points_on_lines_.AddKeyframe(points, lines);
    return points_on_lines_.verified();
  }
  PointsOnLines points_on_lines_;
};

TEST_F(PointsOnLinesTest, VerifiesAfterFourKeyframesInARow) {
  EXPECT_THAT(Add({Point(1, 200.5, 200)}, {kSlanted}, 3), IsEmpty());
  EXPECT_THAT(Add({Point(1, 200.5, 200)}, {kSlanted}), ElementsAre(kPair));
  EXPECT_THAT(points_on_lines_.CollectPoints(7), ElementsAre(1));
}

TEST_F(PointsOnLinesTest, TakesPointsNearTheEndsButNotBeyond) {
  const double near = 300 + 3, far = 300 + 20;
  Add({Point(1, near, near), Point(2, far, far), Point(3, 100 - 3, 100 - 3)}, {kSlanted}, 4);
  EXPECT_THAT(points_on_lines_.CollectPoints(7), ElementsAre(1, 3));
}

TEST_F(PointsOnLinesTest, NeedsBothImages) {
  PointObservation only_left = Point(1, 200, 200);
  only_left.right_px.reset();
  Add({only_left, Point(2, 210, 210, kDisparity_px - 6), Point(3, 210, 214)}, {kSlanted}, 6);
  EXPECT_THAT(points_on_lines_.verified(), IsEmpty());
}

TEST_F(PointsOnLinesTest, KeyframesWithoutOneOfThemDoNotCount) {
  Add({Point(1, 200, 200)}, {kSlanted}, 3);
  Add({}, {kSlanted});
  Add({Point(1, 200, 200)}, {});
  EXPECT_THAT(Add({Point(1, 200, 200)}, {kSlanted}), ElementsAre(kPair));
}

TEST_F(PointsOnLinesTest, AViewApartStartsTheCountAnewAndBreaksAMembership) {
  Add({Point(1, 200, 200)}, {kSlanted}, 3);
  Add({Point(1, 204, 200)}, {kSlanted});
  EXPECT_THAT(Add({Point(1, 200, 200)}, {kSlanted}, 3), IsEmpty());
  EXPECT_THAT(Add({Point(1, 200, 200)}, {kSlanted}), ElementsAre(kPair));
  EXPECT_THAT(Add({Point(1, 250, 200)}, {kSlanted}), IsEmpty());
}

TEST_F(PointsOnLinesTest, SharesAPointOnlyBetweenLinesThatCross) {
  const LineObservation crossing = Line(8, {150, 250}, {250, 150});
  const LineObservation beside = Line(9, {100, 101}, {300, 301});
  Add({Point(1, 200, 200), Point(2, 220, 220.2)}, {kSlanted, crossing, beside}, 4);
  EXPECT_THAT(points_on_lines_.verified(),
              ElementsAre(PointOnLine{1, 7}, PointOnLine{1, 8}, PointOnLine{2, 7}));
}

TEST_F(PointsOnLinesTest, ReleasedPairsDoNotComeBack) {
  Add({Point(1, 200, 200), Point(2, 220, 220)}, {kSlanted}, 4);
  points_on_lines_.Release(kPair);
  Add({Point(1, 200, 200), Point(2, 220, 220)}, {kSlanted}, 5);
  EXPECT_THAT(points_on_lines_.CollectPoints(7), ElementsAre(2));
  points_on_lines_.ReleasePoint(2);
  EXPECT_THAT(points_on_lines_.verified(), IsEmpty());
}

TEST_F(PointsOnLinesTest, ALineTakesOverAnothersPoints) {
  Add({Point(1, 200, 200)}, {kSlanted}, 4);
  points_on_lines_.MergeLine(7, 12);
  EXPECT_THAT(points_on_lines_.verified(), ElementsAre(PointOnLine{1, 12}));
  points_on_lines_.ReleaseLine(12);
  EXPECT_THAT(points_on_lines_.verified(), IsEmpty());
}

TEST_F(PointsOnLinesTest, FindsLongLinesInAllAreas) {
  std::vector<PointObservation> points;
  for (int i = 0; i < 60; ++i) points.push_back(Point(i, 20 + 10 * i, 40 + 3 * i));
  Add(points, {Line(5, {20, 40}, {610, 217})}, 4);
  EXPECT_EQ(points_on_lines_.CollectPoints(5).size(), 60u);
}

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

// Lines of a building, each measured with a standard deviation of its own, as an estimate shows
// them that is tied to the axis.
class MadeBuilding {
 public:
  explicit MadeBuilding(double true_sigma_rad) : true_sigma_rad_(true_sigma_rad) {}

  void AddLines(int count, BuildingDeviation* deviation) {
    for (int i = 0; i < count; ++i) {
      const double noise_rad = std::uniform_real_distribution<double>(2e-4, 3e-3)(generator_);
      const double tie_rad = deviation->sigma_rad();
      LineDeviation line;
      for (int k = 0; k < 2; ++k) {
        const double off_rad =
            true_sigma_rad_ * normal_(generator_) + noise_rad * normal_(generator_);
        const double own = tie_rad * tie_rad / (tie_rad * tie_rad + noise_rad * noise_rad);
        line.off_rad[k] = own * off_rad;
        line.covariance_rad2(k, k) = own * noise_rad * noise_rad;
      }
      deviation->Add(next_id_, line, tie_rad);
      deviation->Close({next_id_++});
      deviation->Solve();
    }
  }

 private:
  int64_t next_id_ = 0;
  double true_sigma_rad_;
  std::mt19937 generator_{5};
  std::normal_distribution<double> normal_;
};

TEST(BuildingDeviation, LearnsHowFarLinesAreOffWithinItsLimits) {
  const BuildingDeviationOptions options;
  EXPECT_EQ(BuildingDeviation({}).sigma_rad(), options.start_sigma_rad) << "before it knows a line";
  for (const double true_sigma_rad : {0.0, 0.0015, 0.005, 0.012, 0.2}) {
    BuildingDeviation deviation({});
    MadeBuilding(true_sigma_rad).AddLines(300, &deviation);
    const double most_rad = std::min(true_sigma_rad, options.max_sigma_rad);
    EXPECT_NEAR(deviation.sigma_rad(), most_rad, std::max(0.25 * most_rad, 0.0005))
        << true_sigma_rad;
    EXPECT_LE(deviation.sigma_rad(), options.max_sigma_rad + 1e-5);
  }
}

TEST(BuildingDeviation, IsNotMovedByLinesThatFollowNoAxis) {
  BuildingDeviation deviation({});
  MadeBuilding building(0.002), grain(0.03);
  for (int i = 0; i < 30; ++i) {
    building.AddLines(8, &deviation);
    grain.AddLines(2, &deviation);
  }
  EXPECT_GT(deviation.sigma_rad(), 0.0015);
  EXPECT_LT(deviation.sigma_rad(), 0.004);
}

TEST(BuildingDeviation, AFewLinesAskAnExactBuildingWhetherItIs) {
  const BuildingDeviationOptions options;
  const double own = std::sqrt(1 - options.shared_share);
  BuildingDeviation deviation(options);
  MadeBuilding(0).AddLines(100, &deviation);
  int probes = 0;
  for (int64_t id = 0; id < 100; ++id) {
    const bool is_probe = deviation.OfNewLine(id) > 0;
    probes += is_probe;
    EXPECT_EQ(deviation.OfLine(id), is_probe ? own * deviation.sigma_rad() : options.min_sigma_rad);
  }
  EXPECT_EQ(probes, 25);
  MadeBuilding(0.005).AddLines(200, &deviation);
  for (int64_t id = 0; id < 100; ++id) {
    EXPECT_EQ(deviation.OfNewLine(id), own * deviation.sigma_rad());
    EXPECT_EQ(deviation.OfLine(id), own * deviation.sigma_rad());
  }
  BuildingDeviationOptions exact;
  exact.start_sigma_rad = 0;
  EXPECT_EQ(BuildingDeviation(exact).OfNewLine(0), 0);
}

// What lines share with their neighbours pulls them too, and is taken out as well.
TEST(BuildingDeviation, LearnsFromLinesThatShareWhatTheyAreOff) {
  constexpr double kTrue_rad = 0.004, kNoise_rad = 0.001;
  BuildingDeviation deviation({});
  std::mt19937 generator(7);
  std::normal_distribution<double> normal;
  for (int64_t id = 0; id < 400; ++id) {
    const double tie_rad = std::sqrt(0.5) * deviation.sigma_rad();
    // On (c, e), each of variance t^2 before, y = c + e with its noise is observed.
    const double t2 = tie_rad * tie_rad, gain = t2 / (2 * t2 + kNoise_rad * kNoise_rad);
    LineDeviation line;
    for (int k = 0; k < 2; ++k) {
      const double y_rad = kTrue_rad * normal(generator) + kNoise_rad * normal(generator);
      line.shared_rad[k] = gain * y_rad;
      line.off_rad[k] = 2 * gain * y_rad;
      line.shared_variance_rad2[k] = t2 - gain * t2;
      line.cross_covariance_rad2[k] = t2 - 2 * gain * t2;
      line.covariance_rad2(k, k) = 2 * t2 - 4 * gain * t2;
    }
    deviation.Add(id, line, tie_rad);
    deviation.Close({id});
    deviation.Solve();
  }
  EXPECT_NEAR(deviation.sigma_rad(), kTrue_rad, 0.1 * kTrue_rad);
}

TEST(BuildingDeviation, LearnsFromLinesThatAreStillInTheWindow) {
  BuildingDeviation deviation({});
  const double tie_rad = deviation.sigma_rad();
  LineDeviation line;
  line.covariance_rad2 = 1e-8 * Eigen::Matrix2d::Identity();
  for (const bool off : {false, true}) {
    line.off_rad.setConstant(off ? 0.004 : 0);
    for (int i = 0; i < 20; ++i) deviation.Add(i, line, tie_rad);
    deviation.Solve();
    EXPECT_EQ(deviation.sigma_rad() > 0.003, off) << "each line has replaced what it said before";
  }
  // Tied as tightly as this they say nothing new.
  line.off_rad.setZero();
  line.covariance_rad2 = 9.9e-9 * Eigen::Matrix2d::Identity();
  const double learned_rad = deviation.sigma_rad();
  for (int i = 0; i < 20; ++i) deviation.Add(i, line, 1e-4);
  deviation.Close({0, 1, 2, 3, 4, 5, 6, 7, 8, 9});
  deviation.Solve();
  EXPECT_EQ(deviation.sigma_rad(), learned_rad);
}

// Nobody knows of a building's handrails, however exact its walls are.
TEST(LineDeviations, SlopesHaveTheirOwn) {
  LineDeviations deviations{BuildingDeviationOptions{}};
  MadeBuilding(0).AddLines(300, &deviations.Of(LineAxis::kX));
  EXPECT_LT(deviations.Of(LineAxis::kVertical).sigma_rad(), 0.0005);
  MadeBuilding(0).AddLines(300, &deviations.Of(LineAxis::kSloped));
  EXPECT_NEAR(deviations.Of(LineAxis::kSloped).sigma_rad(),
              BuildingDeviationOptions().start_sigma_rad, 1e-6);
}

}  // namespace
}  // namespace slcmap
