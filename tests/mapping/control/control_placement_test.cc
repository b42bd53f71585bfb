#include "mapping/control/control_placement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "data/core/error.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const Georeference kPlace{"", {691604.2, 5334750.6, 515.3}, 2.5, 0.9997};

// Points of a floor and the one above, exact but for the millimetres given.
std::vector<ControlMatch> MakeMatches(const std::vector<Vector3d>& off_mm) {
  const std::vector<Vector3d> points = {
      {0, 0, 1}, {20, 1, 2}, {19, 12, 1.5}, {-1, 11, 5}, {8, 6, 4}};
  std::vector<ControlMatch> matches;
  for (size_t i = 0; i < off_mm.size(); ++i) {
    matches.push_back({"P" + std::to_string(i), points[i], kPlace * points[i] + 1e-3 * off_mm[i],
                       Vector3d::Constant(0.005)});
  }
  return matches;
}

TEST(ControlPlacement, FindsTurnAndShiftOfExactPoints) {
  const auto placement =
      PlaceOnPoints("c.csv", MakeMatches(std::vector<Vector3d>(5, Vector3d::Zero())), kPlace.scale);
  EXPECT_NEAR(placement.place.turn_rad, kPlace.turn_rad, 1e-9);
  EXPECT_LT((placement.place.origin_m - kPlace.origin_m).norm(), 1e-6);
  EXPECT_NEAR(placement.map_scale, 1, 1e-9);
  EXPECT_NEAR(placement.map_scale_sigma, 0.005 / std::sqrt(2.0) / 20, 2e-4);
  EXPECT_DOUBLE_EQ(placement.scatter, 1);
}

TEST(ControlPlacement, NamesAPointThatIsOff) {
  const auto matches = MakeMatches({{3, -2, 1}, {-4, 1, 2}, {200, 0, 0}, {1, 2, -3}, {0, -1, 0}});
  const auto placement = PlaceOnPoints("c.csv", matches, kPlace.scale);
  EXPECT_THAT(placement.fits, ElementsAre(true, true, false, true, true));
  EXPECT_LT((placement.place.origin_m - kPlace.origin_m).norm(), 0.006);
}

TEST(ControlPlacement, TwoPointsDoButNotOne) {
  EXPECT_NO_THROW(PlaceOnPoints("c.csv", MakeMatches({{0, 0, 0}, {1, 0, 0}}), kPlace.scale));
  EXPECT_THAT(
      [] {
        PlaceOnPoints("c.csv", MakeMatches({{0, 0, 0}}), kPlace.scale);
      },
      ThrowsMessage<DataError>(HasSubstr("c.csv: found that 0 of 1 points")));
  EXPECT_THROW(PlaceOnPoints("c.csv", {}, 1), DataError);
}

TEST(ControlPlacement, TellsSwappedAxes) {
  auto matches = MakeMatches(std::vector<Vector3d>(4, Vector3d::Zero()));
  for (ControlMatch& match : matches) std::swap(match.p_m.x(), match.p_m.y());
  EXPECT_THAT([&] { PlaceOnPoints("c.csv", matches, kPlace.scale); },
              ThrowsMessage<DataError>(
                  AllOf(HasSubstr("point 'P0'"), HasSubstr("swapped 4"), HasSubstr("swap the"))));
}

TEST(ControlPlacement, TellsDegreesAndOtherUnits) {
  auto matches = MakeMatches(std::vector<Vector3d>(4, Vector3d::Zero()));
  for (ControlMatch& match : matches) {
    match.p_m.head<2>() = 1e-5 * (match.p_m - kPlace.origin_m).head<2>() + Eigen::Vector2d(11, 48);
  }
  EXPECT_THAT([&] { PlaceOnPoints("c.csv", matches, 1); },
              ThrowsMessage<DataError>(AllOf(HasSubstr("point 'P0'"), HasSubstr("degrees"))));
  auto feet = MakeMatches(std::vector<Vector3d>(4, Vector3d::Zero()));
  for (ControlMatch& match : feet) match.p_m /= 0.3048;
  EXPECT_THAT([&] { PlaceOnPoints("c.csv", feet, 1); },
              ThrowsMessage<DataError>(HasSubstr("3.27")));
}

TEST(ControlPlacement, RefusesPointsThatDisagree) {
  const auto matches =
      MakeMatches({{0, 0, 0}, {4000, 0, 0}, {0, -7000, 0}, {2000, 3000, 0}, {0, 0, 9000}});
  EXPECT_THAT([&] { PlaceOnPoints("c.csv", matches, kPlace.scale); },
              ThrowsMessage<DataError>(HasSubstr("of 5 points that the map has agree with it")));
}

}  // namespace
}  // namespace slcmap
