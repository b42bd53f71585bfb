#include "data/simulator/sequence_writer.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <thread>
#include <vector>

#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "data/core/progress.h"
#include "data/simulator/ray_scene.h"
#include "data/simulator/shading.h"
#include "data/simulator/simulation.h"
#include "data/source/sequence.h"
#include "tests/testing/example.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Eigen::Vector3f;

constexpr int64_t kStart_ns = 1'400'000'000'000'000'000;

class SequenceWriterTest : public ::testing::Test {
 protected:
  SequenceWriterTest() { options_.start_stamp_ns = kStart_ns; }

  const testing::TempFolder temp_;
  const std::string folder_ = temp_.Path("sequence");
  ImuSimulatorOptions options_;
  const Rig rig_ = ExampleStereoRig();
  const MotionSpline motion_ = ExampleFlight(rig_, 1.0);
};

TEST_F(SequenceWriterTest, TruthComesBackAsItWas) {
  SequenceWriter writer(folder_, 2);
  writer.WriteTruth(motion_, SimulateImu(motion_, options_), kStart_ns);
  for (const char* file : {"/mav0/state_groundtruth_estimate0/data.csv", "/truth/trajectory.tum"}) {
    const Trajectory truth = ReadTrajectory(folder_ + file);
    ASSERT_EQ(truth.size(), 201u);
    EXPECT_EQ(truth[0].stamp_ns, kStart_ns);
    const RigidTransform expected = motion_.PoseAt(0.5), found = truth[100].T_world_imu;
    EXPECT_LT((expected.translation - found.translation).norm(), 1e-8);
    EXPECT_LT(LogRotation(expected.rotation.conjugate() * found.rotation).norm(), 1e-8);
  }
}

TEST_F(SequenceWriterTest, TheReaderFindsWhatWasWritten) {
  const SimulatedImu imu = SimulateImu(motion_, options_);
  const SequenceWriter writer(folder_, 2);
  writer.WriteCalibration(rig_, 20);
  writer.WriteImu(imu.samples);
  writer.WriteImageLists({kStart_ns + 100'000'000, kStart_ns + 150'000'000});
  const Sequence sequence = OpenSequence(folder_);
  EXPECT_EQ(sequence.images.size(), 2u);
  EXPECT_EQ(sequence.images[1].stamp_ns, kStart_ns + 150'000'000);
  ASSERT_EQ(sequence.imu.size(), imu.samples.size());
  EXPECT_LT((sequence.imu[99].specific_force_m_s2 - imu.samples[99].specific_force_m_s2).norm(),
            1e-8);
  for (const int c : {0, 1}) {
    EXPECT_EQ(sequence.rig.cameras[c].distortion, rig_.cameras[c].distortion);
    EXPECT_EQ(sequence.rig.cameras[c].fy_px, rig_.cameras[c].fy_px);
    EXPECT_EQ(sequence.rig.cameras[c].width_px, rig_.cameras[c].width_px);
    EXPECT_TRUE(sequence.rig.T_imu_camera[c].Matrix().isApprox(rig_.T_imu_camera[c].Matrix()));
  }
  EXPECT_EQ(sequence.rig.imu_noise.gyro_walk_rad_s2_sqrthz, rig_.imu_noise.gyro_walk_rad_s2_sqrthz);
  EXPECT_THROW(SequenceWriter over(folder_, 2), OutputError);
}

TEST(MakeFrames, MakesEachFrameOnceAndReportsTheLast) {
  std::vector<std::atomic<int>> made(500);
  int reported = 0;
  const auto progress = [&](int done) {
    EXPECT_GE(done, reported);
    reported = done;
    return true;
  };
  EXPECT_EQ(MakeFrames(
                500, 3, [&](int i) { ++made[i]; }, progress),
            500);
  EXPECT_EQ(reported, 500);
  for (const auto& count : made) EXPECT_EQ(count, 1);
}

TEST(MakeFrames, StopsWithTheFirstFramesWhenAsked) {
  std::vector<std::atomic<int>> made(100'000);
  const auto make = [&](int i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ++made[i];
  };
  const int count = MakeFrames(100'000, 2, make, [](int done) { return done < 5; });
  EXPECT_GE(count, 5);
  EXPECT_LT(count, 10'000);
  for (int i = 0; i < 100'000; ++i) ASSERT_EQ(made[i], i < count ? 1 : 0);
}

TEST(MakeFrames, PassesAnErrorOnButFramesThatWereStoppedDoNotCount) {
  const auto go_on = [](int) { return true; };
  const auto fail = [](int i) {
    if (i == 7) throw OutputError("disk full");
  };
  const auto stop = [](int i) {
    if (i >= 7) throw StoppedError("interrupted");
  };
  EXPECT_THROW(MakeFrames(100, 2, fail, go_on), OutputError);
  EXPECT_EQ(MakeFrames(100, 3, stop, go_on), 7);
}

TEST(ReadSimulatedRig, KnowsThePublishedRigsAndImusAndRefusesOthers) {
  EXPECT_EQ(ReadSimulatedRig("euroc").cameras[1].fx_px, 457.587);
  EXPECT_EQ(ReadSimulatedRig("tumvi").cameras[0].width_px, 512);
  EXPECT_THROW(ReadSimulatedRig("kitti"), ConfigError);
  EXPECT_FALSE(ImuModelFromName("perfect").with_noise);
  EXPECT_THROW(ImuModelFromName("gyroscope"), ConfigError);
}

TEST(MisreadingImu, IsOffByWhatItSays) {
  const ImuCorrection correction = MisreadingImu(0.03, -0.02, 0.5, 7);
  const double off_rad = 0.5 * 3.14159265 / 180;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d accel = correction.accel.inverse().row(axis);
    EXPECT_NEAR(accel.norm(), 1.03, 1e-12);
    EXPECT_NEAR(std::acos(std::min(1.0, accel.normalized()[axis])), axis == 0 ? 0 : off_rad, 1e-6);
    EXPECT_NEAR(Eigen::Vector3d(correction.gyro.inverse().row(axis)).norm(), 0.98, 1e-12);
  }
  EXPECT_NE(MisreadingImu(0.03, -0.02, 0.5, 8).accel, correction.accel);
}

TEST(Miscalibrated, DiffersByWhatItSays) {
  const Rig rig = ReadSimulatedRig("euroc");
  double focal = 0, mounting_rad = 0, between_rad = 0;
  const int count = 200;
  for (int seed = 0; seed < count; ++seed) {
    const Rig wrong = Miscalibrated(rig, 2.0, seed);
    focal += std::pow(wrong.cameras[0].fx_px / rig.cameras[0].fx_px - 1, 2);
    const auto turn = [&](int c) {
      return wrong.T_imu_camera[c].rotation * rig.T_imu_camera[c].rotation.conjugate();
    };
    mounting_rad += LogRotation(turn(0)).squaredNorm();
    between_rad += LogRotation(turn(0).conjugate() * turn(1)).squaredNorm();
  }
  const double degree = 3.14159265 / 180;
  EXPECT_NEAR(std::sqrt(focal / count), 0.006, 0.001);
  EXPECT_NEAR(std::sqrt(mounting_rad / (3 * count)), 0.6 * degree, 0.1 * degree);
  EXPECT_NEAR(std::sqrt(between_rad / (3 * count)), 0.1 * degree, 0.02 * degree);
  EXPECT_EQ(Miscalibrated(rig, 0, 1).cameras[1].cx_px, rig.cameras[1].cx_px);
}

// A floor of 8 x 8 m with a small lamp 3 m above its middle and, if asked for, a screen between.
Scene LitFloor(bool with_screen) {
  Scene scene;
  scene.ambient = 0.1f;
  scene.materials = {{TextureKind::kPlain, 0.5, 0, 1}, {TextureKind::kLamp, 0, 0, 1}};
  scene.quads = {{{-4, -4, 0}, {8, 0, 0}, {0, 8, 0}, 0, {0, 0}},
                 {{-0.1f, -0.1f, 3}, {0.2f, 0, 0}, {0, 0.2f, 0}, 1, {0, 0}}};
  scene.lamps = {{{-0.1f, -0.1f, 3}, {0.2f, 0, 0}, {0, 0.2f, 0}, 100}};
  if (with_screen) scene.quads.push_back({{-1, -1, 1.5}, {2, 0, 0}, {0, 2, 0}, 0, {0, 0}});
  return scene;
}

constexpr float kStains = 0.17f;  // the largest part by which paint is uneven

TEST(LightBakingTest, LightFallsOffAsOfASmallLampAndAScreenThrowsAShadow) {
  const Scene scene = LitFloor(false);
  const LightMaps light = LightMaps::Bake(scene, RayScene(scene.quads), {});
  for (const float x_m : {0.0f, 2.0f, 3.0f}) {
    const float distance2 = 9 + x_m * x_m;
    const float expected =
        0.1f + 100 * 0.04f * 9 / (distance2 * distance2 * std::numbers::pi_v<float>);
    EXPECT_NEAR(light.At(0, true, 0.5f + x_m / 8, 0.5f), expected, kStains * expected) << x_m;
  }
  EXPECT_NEAR(light.At(0, false, 0.5f, 0.5f), 0.1f, kStains * 0.1f);  // from below
  const Scene screened = LitFloor(true);
  const LightMaps shadow = LightMaps::Bake(screened, RayScene(screened.quads), {});
  EXPECT_NEAR(shadow.At(0, true, 0.5f, 0.5f), 0.1f, kStains * 0.1f);
  EXPECT_NEAR(shadow.At(0, true, 0.5f + 1.6f / 8, 0.5f), 0.1f, kStains * 0.1f);
  EXPECT_GT(shadow.At(0, true, 0.5f + 2.6f / 8, 0.5f), 0.12f);
}

TEST(LightBakingTest, RefusesAbsurdOptionsAndAFloorWithoutEnd) {
  Scene scene = LitFloor(false);
  LightBakingOptions options;
  options.texel_m = 0;
  EXPECT_THROW(LightMaps::Bake(scene, RayScene(scene.quads), options), ConfigError);
  scene.quads[0].u.x() = scene.quads[0].v.y() = 1000;
  const std::string message =
      testing::MessageOf<ConfigError>([&] { LightMaps::Bake(scene, RayScene(scene.quads), {}); });
  for (const char* part : {"takes 32032026 nodes", "at most 30000000 nodes"}) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
  }
}

TEST(LightBakingTest, ReportsHowFarItIsAndCanBeEnded) {
  Scene scene = LitFloor(false);
  scene.quads[0].u.x() = scene.quads[0].v.y() = 100;
  double last = 0;
  const Progress heard([&](double done) {
    EXPECT_GE(done, last);
    last = done;
    return true;
  });
  LightMaps::Bake(scene, RayScene(scene.quads), {.texel_m = 1}, heard);
  EXPECT_EQ(last, 1);
  const Progress ended([](double) { return false; });
  EXPECT_THROW(LightMaps::Bake(scene, RayScene(scene.quads), {}, ended), StoppedError);
}

TEST(GlassPanes, MirrorFourPerCentAFaceInFrontAndAllAtAGlance) {
  EXPECT_NEAR(MirroredShare(1), 2 * 0.04 / 1.04, 1e-5);
  EXPECT_NEAR(MirroredShare(0), 1, 1e-5);
  // At Brewster's angle a face mirrors of one polarisation ((1.5^2 - 1) / (1.5^2 + 1))^2.
  const float brewster = std::cos(std::atan(1.5f));
  const double face = 0.5 * std::pow(1.25 / 3.25, 2);
  EXPECT_NEAR(MirroredShare(brewster), 2 * face / (1 + face), 1e-5);
}

// Upright, across x.
ScenePane PaneAt(float x_m) { return {{x_m, -1, -1}, {0, 2, 0}, {0, 0, 2}}; }

TEST(GlassPanes, AreMetFromNearToFarAndNotBehindTheHit) {
  const GlassPanes panes({PaneAt(3), PaneAt(1), PaneAt(7)});
  RayScene::Packet packet;
  packet.Clear();
  packet.Set(0, Vector3f::Zero(), Vector3f(0.8f, 0, 0.6f).normalized(), 5);  // leaves above 1 m
  packet.Set(2, Vector3f::Zero(), Vector3f::UnitX(), 5);
  GlassPanes::Way way(panes, packet);
  GlassPanes::Mirrored mirrored;
  ASSERT_TRUE(way.Next(&mirrored));
  EXPECT_NEAR(mirrored.way_m[0], 1.25, 1e-5);
  EXPECT_NEAR(mirrored.rays.rays.ray.dir_x[0], -0.8, 1e-5);
  EXPECT_NEAR(mirrored.rays.rays.ray.dir_z[0], 0.6, 1e-5);
  EXPECT_NEAR(mirrored.rays.rays.ray.org_z[0], 0.75, 1e-5);
  EXPECT_NEAR(mirrored.share[0], MirroredShare(0.8f), 1e-6);
  EXPECT_EQ(mirrored.share[1], 0);
  EXPECT_EQ(mirrored.rays.active[1], 0);
  EXPECT_NEAR(mirrored.way_m[2], 1, 1e-5);
  ASSERT_TRUE(way.Next(&mirrored));
  EXPECT_EQ(mirrored.share[0], 0);
  EXPECT_NEAR(mirrored.way_m[2], 3, 1e-4);
  EXPECT_FALSE(way.Next(&mirrored));
  EXPECT_TRUE(panes.Between({2, 0, 0}, {4, 0, 0}));
  EXPECT_FALSE(panes.Between({2, 0, 0}, {2.9f, 0, 0}));
}

}  // namespace
}  // namespace slcmap
