#include "mapping/control/control.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "data/core/coordinate_system.h"
#include "data/core/error.h"
#include "mapping/control/control_placement.h"
#include "mapping/control/triangulation.h"
#include "mapping/map/part_files.h"
#include "mapping/mapping.h"
#include "tests/testing/made_run.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const Georeference kGrid{"EPSG:25832", {691607.25, 5334760.5, 515}, 0.7, 0.99997};

// Places before the wall that the made run looks at, with names of no tags.
const std::vector<Vector3d> kPoints = {{10, -1.5, 0.2}, {10, 1.4, 0.3},  {10, 1.2, 1.8},
                                       {9, -1, 1.7},    {8.5, 0.8, 1.1}, {9.5, 0, 0.5}};

// The points of a place on earth, and where cameras at these poses see them.
template <typename Poses>
void AddPoints(const Georeference& place, const Vector3d& sigma_m, const Rig& rig,
               const Poses& poses, Control* control) {
  for (size_t i = 0; i < kPoints.size(); ++i) {
    const std::string name = "P" + std::to_string(i);
    control->points.push_back({name, place * kPoints[i], sigma_m});
    for (const auto& pose : poses) {
      for (const int camera : {0, 1}) {
        const RigidTransform T_world_camera = pose.T_world_imu * rig.T_imu_camera[camera];
        const auto px = rig.cameras[camera].Project(T_world_camera.Inverse() * kPoints[i]);
        if (px) control->sightings.push_back({name, pose.stamp_ns, camera, *px, 0.3});
      }
    }
  }
}

class ControlTest : public ::testing::Test {
 protected:
  ControlTest() {
    place_.scale = CoordinateSystem(kGrid.crs).At(kGrid.origin_m)->scale;
    AddPoints(place_, Vector3d::Constant(0.005), map_.rectified_rig, map_.keyframes, &control_);
  }

  void Place() { PlaceOnControl(control_, map_.rectified_rig, &map_); }

  MapResult map_ = MapRun(testing::MakeWallRun(), nullptr, {});
  Georeference place_ = kGrid;
  Control control_{.path = "control.csv", .crs = kGrid.crs};
};

TEST_F(ControlTest, PlacesTheMapWhereItsPointsAre) {
  Place();
  const Georeference& found = *map_.source.georeference;
  EXPECT_EQ(found.crs, kGrid.crs);
  EXPECT_NEAR(found.turn_rad, kGrid.turn_rad, 1e-5);
  EXPECT_LT((found.origin_m - kGrid.origin_m).norm(), 1e-4);
  EXPECT_LT(map_.control->rms_m, 1e-4);
  EXPECT_NEAR(map_.control->map_scale, 1, 1e-4);
  for (const ControlResidual& point : map_.control->points) {
    EXPECT_EQ(point.status, ControlStatus::kUsed) << point.name;
    EXPECT_GE(point.views, 8) << point.name;
  }
}

TEST_F(ControlTest, NamesWhatIsOffUnseenOrReadWrongly) {
  control_.points[1].p_m.y() += 0.3;
  control_.points.push_back({"P9", place_ * Vector3d(1, 1, 1), Vector3d::Constant(0.005)});
  control_.sightings[3].px += Eigen::Vector2d(40, 10);  // as of a tag that was read wrongly
  Place();
  const ControlFit& fit = *map_.control;
  EXPECT_EQ(fit.points[1].status, ControlStatus::kOutlier);
  EXPECT_NEAR(fit.points[1].off_m.y(), -0.3, 1e-3);
  EXPECT_EQ(fit.points[6].status, ControlStatus::kUnseen);
  EXPECT_EQ(fit.points[0].views, fit.points[2].views - 1);
  EXPECT_LT(fit.rms_m, 1e-4);
}

TEST_F(ControlTest, HoldsKnownDistancesAgainstTheMap) {
  control_.points.clear();
  control_.distances = {{"P0", "P1", 2.9}};
  Place();
  EXPECT_FALSE(map_.source.georeference);
  EXPECT_NEAR(map_.control->distances.at(0).mapped_m, (kPoints[1] - kPoints[0]).norm(), 1e-4);
  control_.distances = {{"P0", "P8", 2.9}};
  EXPECT_THAT([&] { Place(); }, ThrowsMessage<DataError>(HasSubstr("--distance: point 'P8'")));
}

TEST_F(ControlTest, RefusesWhatIsElsewhere) {
  Control swapped = control_;
  for (ControlPoint& point : swapped.points) std::swap(point.p_m.x(), point.p_m.y());
  EXPECT_THAT([&] { FindGridScale(swapped); },
              ThrowsMessage<DataError>(
                  AllOf(HasSubstr("control.csv: point 'P0'"), HasSubstr("swap the columns"))));
  Control elsewhere = control_;
  elsewhere.crs = "EPSG:27700";  // Great Britain's
  EXPECT_THAT([&] { FindGridScale(elsewhere); },
              ThrowsMessage<DataError>(HasSubstr("name the system that they are in")));
  control_.sightings[0].stamp_ns += 1;
  EXPECT_THAT([&] { Place(); }, ThrowsMessage<DataError>(HasSubstr("the map has no image")));
  --control_.sightings[0].stamp_ns;
  control_.sightings.resize(1);
  EXPECT_THAT([&] { Place(); }, ThrowsMessage<DataError>(HasSubstr(fmt::format(
                                    "seen at all: P0 at {}", control_.sightings[0].stamp_ns))));
  control_.sightings.clear();
  EXPECT_THAT([&] { Place(); }, ThrowsMessage<DataError>(AllOf(HasSubstr("found 0 of 6 control"),
                                                               HasSubstr("seen at all: none"))));
}

TEST(Georeferences, MoveWithTheFrame) {
  const RigidTransform T(ExpRotation({0, 0, 0.4}), {1, 2, 3});
  const Vector3d p(4, -5, 6);
  EXPECT_LT((*MoveGeoreference(kGrid, T) * (T * p) - kGrid * p).norm(), 1e-8);
  EXPECT_FALSE(MoveGeoreference(std::nullopt, T));
}

TEST(ControlTies, AreInTheRunsWorldAndSeenByItsKeyframes) {
  OdometryRun run = testing::MakeWallRun();
  run.source = testing::MakeSource(run);
  Control control{.path = "control.csv"};
  AddPoints({"", {100, 200, 5}, 2.5, 1}, {0.004, 0.005, 0.01}, run.rectified_rig, run.keyframes,
            &control);
  control.points[2].p_m.x() += 1;  // is left out
  const size_t before = run.landmarks.size();
  control.distances = {{"P0", "P2", 3.1}, {"P0", "P1", 9}};  // the second is another one
  const auto [ties, distances] = TieToControl(control, &run);
  ASSERT_EQ(ties.size(), kPoints.size() - 1);
  ASSERT_EQ(run.landmarks.size(), before + ties.size() + 1);
  ASSERT_EQ(distances.size(), 1u);
  EXPECT_EQ(distances[0].from_id, ties[0].landmark_id);
  EXPECT_EQ(distances[0].to_id, run.landmarks.back().id);
  for (size_t i = 0; i < ties.size(); ++i) {
    const Landmark& landmark = run.landmarks[before + i];
    EXPECT_EQ(landmark.id, ties[i].landmark_id);
    EXPECT_GE(landmark.observations, 3);
    EXPECT_LT((landmark.p_world - ties[i].p_world).norm(), 1e-3);
    EXPECT_EQ(ties[i].sigma_m, Vector3d(0.005, 0.005, 0.01));
  }
  control.points.resize(2);
  control.distances.clear();
  EXPECT_TRUE(TieToControl(control, &run).empty());
}

TEST(ControlTies, ARunWhoseCamerasAreFartherApartThanGivenIsScaled) {
  OdometryRun run = testing::MakeWallRun();
  run.source = testing::MakeSource(run);
  Control control{.path = "control.csv"};
  AddPoints({"", {100, 200, 5}, 2.5, 1}, Vector3d::Constant(0.001), run.rectified_rig,
            run.keyframes, &control);
  control.points.clear();
  const auto add_distance = [&](size_t from, size_t to) {
    control.distances.push_back({"P" + std::to_string(from), "P" + std::to_string(to),
                                 1.028 * (kPoints[from] - kPoints[to]).norm(), 0.001});
  };
  for (size_t from = 0; from < kPoints.size(); ++from) {
    for (size_t to = 0; to < from; ++to) add_distance(from, to);
  }
  const auto baseline_m = [&] {
    const auto& T = run.rectified_rig.T_imu_camera;
    return (T[1].translation - T[0].translation).norm();
  };
  const double given_m = baseline_m();
  const Vector3d before = run.keyframes.back().T_world_imu.translation;
  EXPECT_EQ(TieToControl(control, &run).distances.size(), control.distances.size());
  EXPECT_NEAR(baseline_m() / given_m, 1.028, 1e-4);
  EXPECT_LT((run.keyframes.back().T_world_imu.translation - 1.028 * before).norm(), 1e-3);
  EXPECT_EQ(run.warnings.at(kScaledToControl), 1);
  TieToControl(control, &run);  // is right now
  EXPECT_NEAR(baseline_m() / given_m, 1.028, 1e-4);
}

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

TEST(ControlPlacement, APointThatIsOffByLittleDoesNotBendTheFitToItself) {
  const auto matches = MakeMatches({{3, -2, 1}, {-4, 1, 2}, {60, 0, 0}, {1, 2, -3}, {0, -1, 0}});
  const auto placement = PlaceOnPoints("c.csv", matches, kPlace.scale);
  EXPECT_THAT(placement.fits, ElementsAre(true, true, false, true, true));
  EXPECT_LT(std::abs(placement.place.turn_rad - kPlace.turn_rad), 1e-3);
}

// As odometry leaves it that has drifted: all are off, none is wrong.
TEST(ControlPlacement, OfAMapThatIsTooLongAllPointsCount) {
  for (const size_t count : {2, 3, 4, 5}) {
    std::vector<ControlMatch> matches = MakeMatches(std::vector<Vector3d>(count, Vector3d::Zero()));
    for (ControlMatch& match : matches) match.p_world.head<2>() *= 1.003;
    for (ControlMatch& match : matches) match.sigma_m.setConstant(0.002);
    const auto placement = PlaceOnPoints("c.csv", matches, kPlace.scale);
    EXPECT_THAT(placement.fits, ::testing::Each(true)) << count;
  }
}

TEST(ControlPlacement, ExactDistancesOfUnlikeWorthScaleNothing) {
  Control control;
  std::map<std::string, PlacedPoint> placed = {{"A", {{0, 0, 0}, 0.004}},
                                               {"B", {{25, 0, 0}, 0.004}}};
  control.distances = {{"A", "B", 25.003, 0.003}};
  double at_m = 0;
  for (const char* name : {"C", "D", "E"}) {  // near each other, and hardly placed
    placed[name] = {{at_m, 5, 0}, 0.015};
    if (at_m > 0) control.distances.push_back({"C", name, 1.02 * at_m, 0.003});
    at_m += 1.2;
  }
  const auto scale = MeasureScale(control, placed, 1);
  ASSERT_TRUE(scale);
  EXPECT_LT(std::abs(scale->times - 1), 3 * scale->sigma);
  EXPECT_LT(std::abs(scale->times - 1), 0.001);
}

TEST(ControlPlacement, TwoPointsDoButNotOne) {
  EXPECT_NO_THROW(PlaceOnPoints("c.csv", MakeMatches({{0, 0, 0}, {1, 0, 0}}), kPlace.scale));
  EXPECT_THROW(PlaceOnPoints("c.csv", {}, 1), DataError);
}

TEST(ControlPlacement, TellsWhyPointsDisagree) {
  const std::vector<ControlMatch> good = MakeMatches(std::vector<Vector3d>(4, Vector3d::Zero()));
  std::vector<ControlMatch> swapped = good, degrees = good, feet = good;
  for (ControlMatch& match : swapped) std::swap(match.p_m.x(), match.p_m.y());
  for (ControlMatch& match : degrees) {
    match.p_m.head<2>() = 1e-5 * (match.p_m - kPlace.origin_m).head<2>() + Eigen::Vector2d(11, 48);
  }
  for (ControlMatch& match : feet) match.p_m /= 0.3048;
  using Words = std::vector<const char*>;
  for (const auto& [matches, scale, words] :
       {std::tuple(MakeMatches({{0, 0, 0}}), kPlace.scale,
                   Words{"c.csv: found that 0 of 1 points"}),
        {swapped, kPlace.scale, Words{"point 'P0'", "swapped 4", "swap the"}},
        {degrees, 1.0, Words{"point 'P0'", "degrees"}},
        {feet, 1.0, Words{"3.27"}},
        {MakeMatches({{0, 0, 0}, {4000, 0, 0}, {0, -7000, 0}, {2000, 3000, 0}, {0, 0, 9000}}),
         kPlace.scale, Words{"of 5 points that the map has agree with it"}}}) {
    std::string message;
    try {
      PlaceOnPoints("c.csv", matches, scale);
    } catch (const DataError& error) {
      message = error.what();
    }
    for (const char* word : words) EXPECT_THAT(message, HasSubstr(word));
  }
}

}  // namespace
}  // namespace slcmap
