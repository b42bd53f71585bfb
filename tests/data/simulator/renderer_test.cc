// Rendered images against the camera model, geometry and statistics of a sensor.
#include "data/simulator/renderer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <opencv2/core.hpp>
#include <vector>

#include "data/core/error.h"
#include "data/io/ply.h"
#include "data/simulator/motion.h"
#include "data/simulator/ray_scene.h"
#include "data/simulator/sequence_writer.h"
#include "data/simulator/shading.h"
#include "tests/testing/small_scenes.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using testing::LookingAlongX;
using testing::SlidingTask;
using testing::SmallRig;
using testing::TwoToneWall;

// Exact in brightness: without noise and vignetting, exposed for the given time at gain 1.
RendererOptions CleanOptions(double exposure_ms) {
  RendererOptions options;
  options.camera.exposure_ms = exposure_ms;
  options.camera.max_gain = 1;
  options.camera.with_noise = false;
  options.camera.vignetting = 0;
  options.light.texel_m = 1;  // light is even here
  return options;
}

struct Step {
  double position_px, variance_px2;  // mean and spread of the grey value's change
};

// Of the only step in a row of the image between two columns.
Step StepInRow(const cv::Mat& image, int row, int first, int last) {
  double sum = 0, sum_x = 0, sum_xx = 0;
  for (int x = first; x < last; ++x) {
    const double change =
        static_cast<double>(image.at<uint8_t>(row, x + 1)) - image.at<uint8_t>(row, x);
    sum += change;
    sum_x += change * (x + 0.5);
    sum_xx += change * (x + 0.5) * (x + 0.5);
  }
  const double mean = sum_x / sum;
  return {mean, sum_xx / sum - mean * mean};
}

// Where the line y = 0 of the wall crosses a row of the image, by bisection along the line.
double ProjectedColumn(const Camera& camera, const RigidTransform& T_camera_world, double wall_m,
                       double row) {
  double low = -4, high = 4;
  Eigen::Vector2d pixel;
  for (int i = 0; i < 60; ++i) {
    const double z = 0.5 * (low + high);
    const auto projected = camera.Project(T_camera_world * Eigen::Vector3d(wall_m, 0, z));
    pixel = projected.value_or(Eigen::Vector2d(0, z > 0 ? -1e3 : 1e3));
    (pixel.y() < row ? high : low) = z;
  }
  return pixel.x();
}

RenderTask StillTask(Distortion distortion, int frames = 1,
                     const RigidTransform& T_world_imu = LookingAlongX()) {
  return SlidingTask(SmallRig(distortion), T_world_imu, Eigen::Vector3d::Zero(), frames);
}

// What the left camera of a task sees first, exposed for a time.
cv::Mat SeenBy(const RenderTask& task, const Scene& scene, double exposure_ms) {
  return MakeSceneRenderer(scene, CleanOptions(exposure_ms), task)->Render(0, false).left;
}

class RenderedCameraTest : public ::testing::TestWithParam<Distortion> {};

TEST_P(RenderedCameraTest, AnEdgeIsWhereTheCameraModelProjectsIt) {
  constexpr double kWall_m = 3;
  RigidTransform pose = LookingAlongX();
  pose.rotation = pose.rotation * ExpRotation({0, 0.25, 0.06});  // aside and rolled
  const RenderTask task = StillTask(GetParam(), 1, pose);
  const RenderedPair pair =
      MakeSceneRenderer(TwoToneWall(kWall_m, true, 0.8f, 0.1f), CleanOptions(1), task)
          ->Render(0, false);
  for (const int c : {0, 1}) {
    const cv::Mat& image = c == 0 ? pair.left : pair.right;
    const RigidTransform T_camera_world = (pose * task.rig.T_imu_camera[c]).Inverse();
    double sum = 0, sum2 = 0;
    for (int row = 20; row < 100; ++row) {
      const double expected = ProjectedColumn(task.rig.cameras[c], T_camera_world, kWall_m, row);
      const int column = static_cast<int>(expected);
      const double error = StepInRow(image, row, column - 5, column + 6).position_px - expected;
      sum += error;
      sum2 += error * error;
    }
    EXPECT_LT(std::abs(sum / 80), 0.05) << "camera " << c;
    EXPECT_LT(std::sqrt(sum2 / 80), 0.25) << "camera " << c;
  }
}

INSTANTIATE_TEST_SUITE_P(Models, RenderedCameraTest,
                         ::testing::Values(Distortion::kNone, Distortion::kRadialTangential,
                                           Distortion::kEquidistant));

TEST(RendererTest, DepthOfAPlaneAcrossTheViewIsItsDistance) {
  const RenderTask task = StillTask(Distortion::kRadialTangential);
  const auto renderer = MakeSceneRenderer(TwoToneWall(4, true, 0.8f, 0.1f), CleanOptions(1), task);
  EXPECT_TRUE(renderer->Render(0, false).depth_m.empty());
  const cv::Mat depth_m = renderer->Render(0, true).depth_m;
  ASSERT_EQ(depth_m.size(), cv::Size(188, 120));
  double low, high;
  cv::minMaxLoc(depth_m, &low, &high);
  EXPECT_NEAR(low, 4, 1e-4);
  EXPECT_NEAR(high, 4, 1e-4);
}

// A pane before a black void mirrors the wall behind the camera, as a camera at the mirrored place
// sees it, from right to left; what it does not mirror of a wall behind it comes through.
TEST(RendererTest, APaneMirrorsWhatIsBeforeItAndLetsTheRestThrough) {
  constexpr float kPane_m = 2, kBehind_m = 1;
  constexpr int kRow = 61;
  const RenderTask task = StillTask(Distortion::kNone);
  const ScenePane pane = {{kPane_m, -20, -20}, {0, 40, 0}, {0, 0, 40}};
  Scene scene = TwoToneWall(-kBehind_m, true, 0.8f, 0.1f);
  const RigidTransform facing{CameraLookingAlong(-Eigen::Vector3d::UnitX()), {2 * kPane_m, 0, 0}};
  const cv::Mat bright = SeenBy(StillTask(Distortion::kNone, 1, facing), scene, 1);
  scene.panes = {pane};
  const cv::Mat faint = SeenBy(task, scene, 10);
  const double cx_px = task.rig.cameras[0].cx_px;
  for (const int x : {80, 86, 97, 103}) {
    const int mirrored = static_cast<int>(std::lround(2 * cx_px)) - x;
    EXPECT_NEAR(static_cast<double>(faint.at<uint8_t>(kRow, x)),
                10 * MirroredShare(1) * bright.at<uint8_t>(kRow, mirrored), 1.5);
  }
  EXPECT_NEAR(StepInRow(faint, kRow, 80, 103).position_px, cx_px, 0.1);
  scene = TwoToneWall(3, true, 0.8f, 0.1f);
  const double free = SeenBy(task, scene, 2).at<uint8_t>(kRow, 85);
  scene.panes = {pane};
  EXPECT_NEAR(SeenBy(task, scene, 2).at<uint8_t>(kRow, 85) / free, 1 - MirroredShare(1), 0.01);
}

TEST(RendererTest, MotionBlursAlongTheMotionOnlyAndAboutItsMiddle) {
  constexpr double kExposure_ms = 15, kSpeed_m_s = 8, kWall_m = 3;
  const Rig rig = SmallRig(Distortion::kNone);
  const double blur_px = 114.5 * kSpeed_m_s * 1e-3 * kExposure_ms / kWall_m;
  // Seen at right angles, so that a step of the wall is a step of a row; dim, not to saturate.
  const auto mean_step = [&](bool upright, const Eigen::Vector3d& velocity_m_s) {
    const RenderTask task = SlidingTask(rig, LookingAlongX(), velocity_m_s, 1);
    cv::Mat image = SeenBy(task, TwoToneWall(kWall_m, upright, 0.08f, 0.01f), kExposure_ms);
    if (!upright) cv::transpose(image, image);
    Step mean{0, 0};
    for (int row = 10; row < 110; ++row) {
      const Step step = upright ? StepInRow(image, row, 75, 107) : StepInRow(image, row, 45, 77);
      mean.position_px += step.position_px / 100;
      mean.variance_px2 += step.variance_px2 / 100;
    }
    return mean;
  };
  const Eigen::Vector3d still = Eigen::Vector3d::Zero(), aside(0, kSpeed_m_s, 0);
  const Step upright = mean_step(true, still), upright_moving = mean_step(true, aside);
  const Step level = mean_step(false, still), level_moving = mean_step(false, aside);
  EXPECT_NEAR(upright_moving.variance_px2 - upright.variance_px2, blur_px * blur_px / 12,
              0.2 * blur_px * blur_px / 12);
  EXPECT_NEAR(level_moving.variance_px2, level.variance_px2, 0.05);
  EXPECT_NEAR(upright_moving.position_px, upright.position_px, 0.1);
  EXPECT_NEAR(level_moving.position_px, level.position_px, 0.02);
}

// Rows of a rolling shutter are those of images that were taken whole, each at the row's time.
TEST(RendererTest, RowsAreExposedAtTheirOwnTimes) {
  Rig rig = SmallRig(Distortion::kRadialTangential);
  const auto task_of = [](const Rig& of, double later_s) {
    RenderTask task = SlidingTask(of, LookingAlongX(), {0.5, 3, -1}, 1);
    task.times_s[0] += later_s;
    return task;
  };
  const Scene scene = TwoToneWall(3, true, 0.8f, 0.1f);
  Rig rolling = rig;
  rolling.readout_s = {0.03, -0.02};
  rolling.right_time_offset_s = 0.008;
  const auto render = [&](const Rig& of, double later_s) {
    return MakeSceneRenderer(scene, CleanOptions(1), task_of(of, later_s))->Render(0, true);
  };
  const RenderedPair pair = render(rolling, 0), at_once = render(rig, 0);
  for (const int row : {0, 61, 119}) {
    for (const int camera : {0, 1}) {
      const double later_s = RowTime_s(rolling, camera, row);
      EXPECT_NEAR(
          later_s,
          camera == 0 ? 0.03 * ((row + 0.5) / 120 - 0.5) : 0.008 - 0.02 * ((row + 0.5) / 120 - 0.5),
          1e-12);
      const RenderedPair whole = render(rig, later_s);
      const cv::Mat& of_row = camera == 0 ? pair.left : pair.right;
      const cv::Mat& of_whole = camera == 0 ? whole.left : whole.right;
      // But for how sums of times are rounded.
      const double off = cv::norm(of_row.row(row), of_whole.row(row), cv::NORM_INF);
      EXPECT_LE(off, 2) << camera << " " << row;
      const cv::Mat& at_stamp = camera == 0 ? at_once.left : at_once.right;
      if (std::abs(later_s) > 0.005) {
        EXPECT_GT(cv::norm(of_row.row(row), at_stamp.row(row), cv::NORM_INF), 10);
      }
      if (camera == 0) EXPECT_EQ(cv::norm(pair.depth_m.row(row), whole.depth_m.row(row)), 0);
    }
  }
}

TEST(RendererTest, NoiseIsThatOfASensorAndNewInEachImage) {
  const RenderTask task = StillTask(Distortion::kNone, 2);
  RendererOptions options;
  options.camera.vignetting = 0;
  const auto renderer = MakeSceneRenderer(TwoToneWall(3, true, 0.5, 0.5), options, task);
  const RenderedPair first = renderer->Render(0, false), second = renderer->Render(1, false);
  const auto deviation = [](const cv::Mat& a, const cv::Mat& b) {
    cv::Mat difference;
    cv::subtract(a, b, difference, cv::noArray(), CV_32F);
    cv::Scalar mean, sigma;
    cv::meanStdDev(difference, mean, sigma);
    EXPECT_NEAR(mean[0], 0, 0.1);
    return sigma[0] / std::numbers::sqrt2;
  };
  EXPECT_NEAR(cv::mean(first.left)[0], options.camera.target_grey, 15);
  EXPECT_GT(deviation(first.left, second.left), 1.2);
  EXPECT_LT(deviation(first.left, second.left), 3);
  EXPECT_EQ(deviation(first.left, renderer->Render(0, false).left), 0);
}

// Lit by a lamp, so that baking in threads is part of it.
Scene LampAndTexture() {
  Scene scene = TwoToneWall(3, true, 0.6f, 0.3f);
  scene.materials[0] = {TextureKind::kConcrete, 0.6f, 1, 3};
  scene.materials[1] = {TextureKind::kPoster, 0.4f, 1, 5};
  scene.materials.push_back({TextureKind::kLamp, 0, 0, 1});
  for (SceneQuad& quad : scene.quads) quad.u *= 0.1f;
  scene.lamps = {{{1, 0, 2}, {0.3f, 0, 0}, {0, 1, 0}, 10}};
  scene.quads.push_back({{1, 0, 2}, {0.3f, 0, 0}, {0, 1, 0}, 2, {0, 0}});
  return scene;
}

TEST(RendererTest, ThreadsChangeNothing) {
  const RenderTask task =
      SlidingTask(SmallRig(Distortion::kRadialTangential), LookingAlongX(), {0.5, 1, 0}, 4);
  const auto render = [&](int threads) {
    RendererOptions options;
    options.light.threads = threads;
    const auto renderer = MakeSceneRenderer(LampAndTexture(), options, task);
    std::vector<RenderedPair> pairs(4);
    MakeFrames(
        4, threads, [&](int f) { pairs[f] = renderer->Render(f, true); }, [](int) { return true; });
    return pairs;
  };
  const auto one = render(1), two = render(2);
  for (int f = 0; f < 4; ++f) {
    EXPECT_EQ(cv::norm(one[f].left, two[f].left, cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(one[f].right, two[f].right, cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(one[f].depth_m, two[f].depth_m, cv::NORM_INF), 0);
  }
}

TEST(RendererTest, WritesEdgesAndSurfaces) {
  EXPECT_THROW(MakeSceneRenderer(Scene{}, {}, StillTask(Distortion::kNone)), DataError);
  const RenderTask task = StillTask(Distortion::kNone, 1);
  Scene scene = TwoToneWall(3, true, 0.5, 0.5);
  scene.edges = {{{3, 0, -0.5}, {3, 0, 0.5}, 2, 0}};
  testing::TempFolder folder;
  MakeSceneRenderer(scene, CleanOptions(1), task)->WriteTruth(folder.Path(), 1);
  EXPECT_EQ(ReadLinesPly(folder.Path("edges.ply")).size(), 1u);
  EXPECT_EQ(ReadPly(folder.Path("surfaces.ply")).Get("vertex", "surfaces.ply").size(), 8u);
  EXPECT_EQ(testing::ReadText(folder.Path("edges.csv")),
            "edge,axis,wing,ax_m,ay_m,az_m,bx_m,by_m,bz_m,seen_from_m,seen_to_m\n"
            "0,2,0,3.0000,0.0000,-0.5000,3.0000,0.0000,0.5000,0.0000,1.0000\n");
}

std::vector<SeenPart> SelectSeen(const Scene& scene) {
  const RayScene rays(scene.quads);
  RenderTask task = StillTask(Distortion::kNone);
  EdgeWatch watch(scene, rays, task);
  watch.Look(0);
  return watch.Parts();
}

// A wall at 4 m and a screen at 2 m that hides what is to the left of the axis from both cameras:
// the right one, 0.1 m to the right, sees the wall 0.1 m further behind the screen.
TEST(EdgeVisibilityTest, HiddenPartsAreNotSeen) {
  Scene scene = testing::TwoToneWall(4, true, 0.5, 0.5);
  scene.quads.push_back({{2, 0, -5}, {0, 10, 0}, {0, 0, 10}, 0, {0, 0}});
  scene.edges = {{{4, -1, 0.3}, {4, 1, 0.3}, 1, 0}};
  const std::vector<SeenPart> seen = SelectSeen(scene);
  ASSERT_EQ(seen.size(), 1u);
  EXPECT_EQ(seen[0].edge, 0);
  EXPECT_NEAR(seen[0].from_m, 0, 1e-9);
  EXPECT_NEAR(seen[0].to_m, 1.1, 0.03);
}

TEST(EdgeVisibilityTest, PartsOutsideTheViewAreNotSeen) {
  Scene scene = testing::TwoToneWall(4, true, 0.5, 0.5);
  scene.edges = {{{-1, 0, 0}, {-2, 0, 0}, 0, 0},         // behind
                 {{4, 0, -9}, {4, 0, 9}, 2, 0},          // beyond both borders
                 {{3.99, 0, 40}, {3.99, 1, 40}, 1, 0}};  // far above
  const std::vector<SeenPart> seen = SelectSeen(scene);
  ASSERT_EQ(seen.size(), 1u);
  EXPECT_EQ(seen[0].edge, 1);
  EXPECT_NEAR(seen[0].from_m, 9 - 4 * (119 - 61.7) / 114.5, 0.03);
  EXPECT_NEAR(seen[0].to_m, 9 + 4 * 61.7 / 114.5, 0.03);
}

TEST(EdgeVisibilityTest, RefusesEdgesWithoutEndAndStopsWhenAsked) {
  Scene scene = testing::TwoToneWall(4, true, 0.5, 0.5);
  scene.edges = {{{4, -1, 0.3}, {4, 1e6, 0.3}, 1, 0}};
  const RayScene rays(scene.quads);
  RenderTask task = StillTask(Distortion::kNone);
  EXPECT_THROW(EdgeWatch(scene, rays, task), ConfigError);
  scene.edges = {{{4, -1, 0.3}, {4, 1, 0.3}, 1, 0}};
  std::stop_source stop;
  stop.request_stop();
  task.stop = stop.get_token();
  EdgeWatch watch(scene, rays, task);
  EXPECT_THROW(watch.Look(0), StoppedError);
}

// The mean step between two columns of level 1.
double StepBetween(const TextureTile& tile, int column, int next) {
  constexpr int kSide = TextureTile::kSide / 2;
  double sum = 0;
  for (int y = 0; y < kSide; ++y) {
    sum += std::abs(tile.levels[1][y * kSide + column] - tile.levels[1][y * kSide + next]);
  }
  return sum / kSide;
}

TEST(TextureTest, KeepsItsMeanOnEachLevelHasDetailAtAllScalesAndNoSeam) {
  constexpr int kSide = TextureTile::kSide / 2;
  for (const TextureKind kind :
       {TextureKind::kPlaster, TextureKind::kConcrete, TextureKind::kWood, TextureKind::kCarpet,
        TextureKind::kBrick, TextureKind::kMetal, TextureKind::kTiles, TextureKind::kBlock,
        TextureKind::kTimber, TextureKind::kCeilingGrid}) {
    SCOPED_TRACE(static_cast<int>(kind));
    const TextureTile tile = MakeTexture(kind, 1);
    for (int l = 0; l < TextureTile::kLevels; ++l) {
      cv::Scalar mean, sigma;
      cv::meanStdDev(tile.levels[l], mean, sigma);
      EXPECT_NEAR(mean[0], 128, 3) << "level " << l;
      const double least_sigma = tile.levels[l].size() < 64 ? 0 : 0.7;
      EXPECT_GE(sigma[0], least_sigma) << "level " << l;
    }
    double largest = 0;
    for (int x = 0; x + 1 < kSide; ++x) largest = std::max(largest, StepBetween(tile, x, x + 1));
    EXPECT_LE(StepBetween(tile, kSide - 1, 0), 1.1 * largest);
  }
}

struct Pattern {
  TextureKind kind;
  double column_m, row_m;  // from joint to joint; staggered ones are met at half a cell
  double least, most;      // how much the joints of rows differ from what is between them
};

// Means of the columns or rows of level 0 less the mean over `period_px` around, 1 is the mean.
std::vector<double> Profile(const TextureTile& tile, bool of_rows, double period_px) {
  constexpr int kSide = TextureTile::kSide;
  const cv::Mat grey(kSide, kSide, CV_8U, const_cast<uint8_t*>(tile.levels[0].data()));
  cv::Mat means;
  cv::reduce(grey, means, of_rows ? 1 : 0, cv::REDUCE_AVG, CV_64F);
  const auto at = [&](int i) { return means.at<double>((i + kSide) % kSide) / 128; };
  const int half = static_cast<int>(period_px / 2);
  std::vector<double> profile(kSide);
  for (int i = 0; i < kSide; ++i) {
    double around = 0;
    for (int k = -half; k <= half; ++k) around += at(i + k) / (2 * half + 1);
    profile[i] = (at(i - 1) + at(i) + at(i + 1)) / 3 - around;
  }
  return profile;
}

double Correlation(const std::vector<double>& profile, double shift_px) {
  double product = 0, square = 0;
  for (size_t i = 0; i < profile.size(); ++i) {
    const size_t j = (i + static_cast<size_t>(std::lround(shift_px))) % profile.size();
    product += profile[i] * profile[j];
    square += profile[i] * profile[i];
  }
  return product / square;
}

TEST(PatternTest, HasJointsWhereARealOneHasThem) {
  for (const Pattern& pattern : {Pattern{TextureKind::kBrick, 0.125, 0.075, 0.15, 0.5},
                                 {TextureKind::kTiles, 0.2, 0.2, 0.15, 0.5},
                                 {TextureKind::kBlock, 0.2, 0.2, 0.04, 0.2},
                                 {TextureKind::kCeilingGrid, 0.6, 0.6, 0.15, 0.5}}) {
    SCOPED_TRACE(static_cast<int>(pattern.kind));
    const TextureTile tile = MakeTexture(pattern.kind, 1);
    for (const bool of_rows : {false, true}) {
      const double period_px = (of_rows ? pattern.row_m : pattern.column_m) / tile.texel_m;
      const std::vector<double> profile = Profile(tile, of_rows, period_px);
      EXPECT_GT(Correlation(profile, period_px), 0.5);
      EXPECT_LT(Correlation(profile, period_px / 2), 0.25);
      if (!of_rows) continue;
      const auto [low, high] = std::minmax_element(profile.begin(), profile.end());
      EXPECT_GT(std::max(-*low, *high), pattern.least);
      EXPECT_LT(std::max(-*low, *high), pattern.most);
    }
  }
}

TEST(TextureSetTest, PostersOfOtherSeedsShowOtherThings) {
  const std::vector<SurfaceMaterial> materials = {{TextureKind::kPoster, 0.5, 1, 1},
                                                  {TextureKind::kPoster, 0.5, 1, 2}};
  const TextureSet textures(materials);
  EXPECT_NE(textures.Of(materials[0]).levels[3], textures.Of(materials[1]).levels[3]);
}

}  // namespace
}  // namespace slcmap
