#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <string>

#include "data/core/error.h"
#include "data/simulator/scene/camera_response.h"
#include "data/simulator/scene/scene.h"
#include "data/simulator/scene/scene_builder.h"
#include "data/simulator/scene/scene_objects.h"
#include "data/simulator/truth.h"
#include "tests/testing/small_scenes.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;
using testing::MessageOf;
using ::testing::SizeIs;
using testing::TempFolder;

// Two rooms of 5 by 4 m less a wall of 0.15 m between them, with an open door and a window.
Scene TwoRooms(double inexact) {
  const TempFolder folder;
  const std::string path = folder.Write("scene.yaml", R"(
objects:
  - {kind: wall, points: [[0, 0], [10, 0], [10, 4], [0, 4]], closed: true}
  - {kind: wall, points: [[5, 0], [5, 4]], has_back: true, doors: [[0, 1, 1, 2.1, 90]], windows: [[0, 2.5, 1, 1.2, 0.9]]}
  - {kind: slab, at: [0, 0, 0], size: [10, 4]}
  - {kind: slab, at: [0, 0, 2.7], size: [10, 4], faces_down: true}
)");
  InexactOptions options;
  options.amount = inexact;
  return ReadScene(path, {}, options);
}

TEST(BuildingTruth, WallsHaveBothFacesAndTheirOpeningsAndRoomsAreBetween) {
  const std::vector<TrueWall> walls = TrueWalls(TwoRooms(0));
  ASSERT_THAT(walls, SizeIs(6));
  // The front of the wall between the rooms is to the left of its way, at x = 5.
  const TrueWall &front = walls[4], &back = walls[5];
  EXPECT_NEAR(front.normal.x(), -1, 1e-9);
  EXPECT_NEAR(front.offset_m, -5, 1e-6);
  EXPECT_NEAR(back.normal.x(), 1, 1e-9);
  EXPECT_NEAR(back.offset_m, 5.15, 1e-6);
  ASSERT_THAT(front.openings, SizeIs(2));
  EXPECT_TRUE(front.openings[0].is_open);
  EXPECT_TRUE(front.openings[0].is_door);
  EXPECT_NEAR(front.openings[0].clear_width_m, 0.96, 1e-9);
  EXPECT_FALSE(front.openings[1].is_open);
  EXPECT_EQ(front.openings[0].id, back.openings[0].id);
  const std::vector<TrueRoom> rooms = TrueRooms(TwoRooms(0));
  ASSERT_THAT(rooms, SizeIs(2));
  EXPECT_NEAR(rooms[0].area_m2, 20, 0.01);
  EXPECT_NEAR(rooms[1].area_m2, 4.85 * 4, 0.01);
  EXPECT_NEAR(rooms[0].height_m, 2.7, 1e-6);
}

TEST(BuildingTruth, InexactWallsAreTheirPlanesOfLeastSquares) {
  const std::vector<TrueWall> exact = TrueWalls(TwoRooms(0)), bent = TrueWalls(TwoRooms(1));
  ASSERT_EQ(exact.size(), bent.size());
  double farthest_m = 0;
  for (size_t i = 0; i < exact.size(); ++i) {
    EXPECT_GT(exact[i].normal.dot(bent[i].normal), 0.9999);
    const double off_m = std::abs(exact[i].offset_m - bent[i].offset_m);
    EXPECT_LT(off_m, 0.05);
    farthest_m = std::max(farthest_m, off_m);
  }
  EXPECT_GT(farthest_m, 0.002);
}

TEST(BuildingTruth, OnlyWhatWasSeenCounts) {
  const Scene scene = TwoRooms(0);
  // The room with x < 5, except its floor; nobody looked through its door.
  const auto is_seen = [](const Vector3d& p) { return p.x() < 4.999; };
  const TrueBuilding building = ObserveBuilding(scene, is_seen, {{1, 1, 1.5}});
  EXPECT_NEAR(building.walls[3].seen_m2, 4 * 2.7, 0.2);  // at x = 0
  EXPECT_EQ(building.walls[1].seen_m2, 0);               // at x = 10
  EXPECT_EQ(building.walls[4].openings[0].looked_through, 0);
  EXPECT_TRUE(building.rooms[0].is_entered);
  EXPECT_FALSE(building.rooms[1].is_entered);
}

TEST(BuildingTruth, FileIsReadBackAndDamageIsNamed) {
  const TempFolder folder;
  const TrueBuilding building =
      ObserveBuilding(TwoRooms(1), [](const Vector3d&) { return true; }, {});
  const std::string path = folder.Path("building.json");
  WriteTrueBuilding(path, building);
  const TrueBuilding read = ReadTrueBuilding(path);
  ASSERT_EQ(read.walls.size(), building.walls.size());
  EXPECT_NEAR(read.walls[4].offset_m, building.walls[4].offset_m, 1e-5);
  EXPECT_EQ(read.walls[4].seen_world.size(), building.walls[4].seen_world.size());
  EXPECT_EQ(read.walls[4].openings[0].is_open, true);
  ASSERT_THAT(read.rooms, SizeIs(2));
  EXPECT_NEAR(read.rooms[1].area_m2, building.rooms[1].area_m2, 1e-5);
  folder.Write("building.json", R"({"format": "slcmap true building", "version": 1})");
  EXPECT_THAT(MessageOf<DataError>([&] { ReadTrueBuilding(path); }), HasSubstr("cell_m: missing"));
}

std::vector<TruePipe> PipesSeen(const Scene& scene) {
  const RayScene rays(scene.quads);
  const RenderTask task = testing::SlidingTask(testing::SmallRig(Distortion::kNone),
                                               testing::LookingAlongX(), {0, 0, 0}, 1);
  return ObservePipes(scene, rays, task, 1);
}

Scene PipesAndScreen(bool with_screen) {
  SceneBuilder builder({Eigen::Isometry3d::Identity()});
  const uint32_t material = builder.AddMaterial({});
  builder.AddPipe({4, -1, 0}, {4, 1, 0}, 0.1, 12, material);
  builder.AddPipe({-4, -1, 0}, {-4, 1, 0}, 0.1, 12, material);     // behind
  builder.AddPipe({12, -1, 0}, {12, 1, 0}, 0.1, 12, material);     // beyond 8 m
  builder.AddRoundBar({3, 0, 1}, {3, 0.5, 1}, 0.1, 12, material);  // no pipe
  if (with_screen) builder.AddQuad({2, 0, -5}, {0, 10, 0}, {0, 0, 10}, material);
  return builder.Finish();
}

TEST(PipeTruth, SaysWhatWasSeenOfEachPipeAndNotWhatIsHidden) {
  const std::vector<TruePipe> pipes = PipesSeen(PipesAndScreen(false));
  ASSERT_EQ(pipes.size(), 3u);
  EXPECT_EQ(pipes[0].radius_m, 0.1);
  ASSERT_EQ(pipes[0].seen.size(), 1u);
  EXPECT_NEAR(pipes[0].SeenLength_m(), 2, 1e-9);
  EXPECT_TRUE(pipes[1].seen.empty());
  EXPECT_TRUE(pipes[2].seen.empty());
  // The right camera, 0.1 m to the right, sees somewhat more behind the screen.
  const std::vector<TruePipe> hidden = PipesSeen(PipesAndScreen(true));
  ASSERT_EQ(hidden[0].seen.size(), 1u);
  EXPECT_NEAR(hidden[0].seen[0].from_m, 0, 1e-9);
  EXPECT_NEAR(hidden[0].seen[0].to_m, 1.1, 0.06);
}

TEST(PipeTruth, APipeRunHasItsPiecesAndFlanges) {
  SceneBuilder builder({Eigen::Isometry3d::Identity()});
  const uint32_t material = builder.AddMaterial({});
  AddPipeRun({{0, 0, 0}, {0, 0, 2}, {1, 0, 2}}, 0.05, 16, material, &builder);
  const Scene scene = builder.Finish();
  ASSERT_EQ(scene.pipes.size(), 4u);
  EXPECT_EQ(scene.pipes[0].radius_m, 0.05);
  EXPECT_EQ(scene.pipes[0].b, Eigen::Vector3d(0, 0, 2));
  EXPECT_LT((scene.pipes[1].b - scene.pipes[1].a).norm(), 0.1);
}

TEST(CameraResponseTest, AutomaticExposureFollowsSlowlyAndKeepsItsLimits) {
  CameraResponseOptions options;
  std::vector<double> times_s, radiance;
  for (int i = 0; i < 120; ++i) {
    times_s.push_back(0.05 * i);
    radiance.push_back(i < 40 ? 0.2 : i < 80 ? 0.01 : 100);
  }
  const std::vector<Exposure> exposures = PlanExposures(times_s, radiance, options);
  EXPECT_NEAR(exposures[0].time_ms * 0.2 * options.sensitivity, options.target_grey, 1e-6);
  EXPECT_EQ(exposures[0].gain, 1);
  EXPECT_GT(exposures[41].time_ms, exposures[40].time_ms);
  EXPECT_LT(exposures[40].time_ms, 3 * exposures[39].time_ms + 1e-9);
  EXPECT_EQ(exposures[79].time_ms, options.max_exposure_ms);
  EXPECT_EQ(exposures[79].gain, options.max_gain);
  EXPECT_EQ(exposures[119].time_ms, options.min_exposure_ms);
  EXPECT_EQ(exposures[119].gain, 1);
  options.max_exposure_ms = 0.1;
  EXPECT_THROW(options.Check(), ConfigError);
}

TEST(CameraResponseTest, SaturatesAndDarkensTheCorners) {
  CameraResponseOptions options;
  options.with_noise = false;
  const CameraResponse response(options, 64, 48);
  cv::Mat radiance(48, 64, CV_32F, cv::Scalar(100 / options.sensitivity));
  radiance.at<float>(24, 32) = 50;
  const cv::Mat image = response.Develop(radiance, {1, 1}, 0, 0);
  EXPECT_EQ(image.at<uint8_t>(24, 32), 255);
  EXPECT_NEAR(image.at<uint8_t>(24, 30), 100, 1);
  EXPECT_NEAR(image.at<uint8_t>(0, 0), 100 * (1 - options.vignetting), 1);
}

// The standard deviation over an image of one brightness, in shares of full scale.
double NoiseAt(double share, const CameraResponseOptions& options) {
  const CameraResponse response(options, 200, 200);
  const cv::Mat radiance(200, 200, CV_32F, cv::Scalar(255 * share / options.sensitivity));
  cv::Scalar mean, sigma;
  cv::meanStdDev(response.Develop(radiance, {1, 1}, 3, 1), mean, sigma);
  EXPECT_NEAR(mean[0] / 255, share, 1e-3);
  return sigma[0] / 255;
}

TEST(CameraResponseTest, LowTextureScenesHaveTheNoiseThatTheySay) {
  for (const char* scene : {"lowtexture_corridor.yaml", "lowtexture_office.yaml"}) {
    CameraResponseOptions options =
        ReadSceneCamera(std::string(SLCMAP_SOURCE_DIR "/config/scenes/") + scene);
    EXPECT_EQ(options.max_gain, 1) << scene;  // so that the noise is the same in the dark
    options.vignetting = 0;
    for (const double share : {0.1, 0.4, 0.8}) {
      EXPECT_NEAR(NoiseAt(share, options), std::sqrt(0.006 * 0.006 + 0.00035 * share), 3e-4);
    }
  }
}

}  // namespace
}  // namespace slcmap
