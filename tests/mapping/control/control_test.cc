#include "mapping/control/control.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "data/core/coordinate_system.h"
#include "data/core/error.h"
#include "data/io/file.h"
#include "mapping/control/triangulation.h"
#include "mapping/map/map_folder.h"
#include "mapping/map/part_files.h"
#include "mapping/mapping.h"
#include "tests/testing/made_run.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const Georeference kGrid{"EPSG:25832", {691607.25, 5334760.5, 515}, 0.7, 0.99997};

// Places before the wall that the made run looks at, with names of no tags.
const std::vector<Vector3d> kPoints = {{10, -1.5, 0.2}, {10, 1.4, 0.3},  {10, 1.2, 1.8},
                                       {9, -1, 1.7},    {8.5, 0.8, 1.1}, {9.5, 0, 0.5}};

class ControlTest : public ::testing::Test {
 protected:
  ControlTest() {
    const CoordinateSystem system(kGrid.crs);
    place_.scale = system.At(kGrid.origin_m)->scale;
    for (size_t i = 0; i < kPoints.size(); ++i) {
      const std::string name = "P" + std::to_string(i);
      control_.points.push_back({name, place_ * kPoints[i], Vector3d::Constant(0.005)});
      for (const StampedPose& pose : map_.keyframes) See(name, kPoints[i], pose);
    }
  }

  void See(const std::string& name, const Vector3d& p_world, const StampedPose& pose) {
    for (int camera = 0; camera < 2; ++camera) {
      const Rig& rig = map_.rectified_rig;
      const RigidTransform T_world_camera =
          pose.T_world_imu * rig.T_imu_camera[static_cast<size_t>(camera)];
      const auto px =
          rig.cameras[static_cast<size_t>(camera)].Project(T_world_camera.Inverse() * p_world);
      if (px) control_.sightings.push_back({name, pose.stamp_ns, camera, *px, 0.3});
    }
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
  control_.sightings.clear();
  EXPECT_THAT([&] { Place(); }, ThrowsMessage<DataError>(AllOf(HasSubstr("found 0 of 6 control"),
                                                               HasSubstr("seen at all: none"))));
}

TEST_F(ControlTest, MapFoldersKeepThePlaceAndTheResiduals) {
  control_.points[1].p_m.y() += 0.3;
  Place();
  const testing::TempFolder temp;
  WriteMapFolder(temp.Path("map"), map_);
  EXPECT_THAT(ReadFile(temp.Path("map/georeference.json")),
              AllOf(HasSubstr("\"crs_name\": \"ETRS89 / UTM zone 32N\""),
                    HasSubstr("\"latitude_deg\": 48.13")));
  EXPECT_THAT(ReadFile(temp.Path("map/control_points.csv")), HasSubstr("\nP1,outlier,"));
  const MapResult read = ReadMapFolder(temp.Path("map"));
  EXPECT_EQ(read.source.georeference->origin_m, map_.source.georeference->origin_m);
  EXPECT_EQ(read.source.georeference->turn_rad, map_.source.georeference->turn_rad);
  ASSERT_EQ(read.control->points.size(), 6u);
  EXPECT_EQ(read.control->points[1].status, ControlStatus::kOutlier);
  EXPECT_NEAR(read.control->points[1].off_m.y(), map_.control->points[1].off_m.y(), 1e-4);
  map_.control.reset();
  WriteMapFolder(temp.Path("map"), map_);
  EXPECT_FALSE(ReadMapFolder(temp.Path("map")).control);
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
  const Georeference place{"", {100, 200, 5}, 2.5, 1};
  for (size_t i = 0; i < kPoints.size(); ++i) {
    const std::string name = "P" + std::to_string(i);
    control.points.push_back({name, place * kPoints[i], Vector3d(0.004, 0.005, 0.01)});
    for (const Keyframe& keyframe : run.keyframes) {
      for (int camera = 0; camera < 2; ++camera) {
        const auto at = static_cast<size_t>(camera);
        const RigidTransform T_camera_world =
            (keyframe.T_world_imu * run.rectified_rig.T_imu_camera[at]).Inverse();
        const auto px = run.rectified_rig.cameras[at].Project(T_camera_world * kPoints[i]);
        if (px) control.sightings.push_back({name, keyframe.stamp_ns, camera, *px, 0.3});
      }
    }
  }
  control.points[2].p_m.x() += 1;  // is left out
  const size_t before = run.landmarks.size();
  const std::vector<ControlTie> ties = TieToControl(control, &run);
  ASSERT_EQ(ties.size(), kPoints.size() - 1);
  ASSERT_EQ(run.landmarks.size(), before + ties.size());
  for (size_t i = 0; i < ties.size(); ++i) {
    const Landmark& landmark = run.landmarks[before + i];
    EXPECT_EQ(landmark.id, ties[i].landmark_id);
    EXPECT_GE(landmark.observations, 3);
    EXPECT_LT((landmark.p_world - ties[i].p_world).norm(), 1e-3);
    EXPECT_EQ(ties[i].sigma_m, Vector3d(0.005, 0.005, 0.01));
  }
  control.points.resize(2);
  EXPECT_TRUE(TieToControl(control, &run).empty());
}

}  // namespace
}  // namespace slcmap
