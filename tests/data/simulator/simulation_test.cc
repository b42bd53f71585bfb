#include "data/simulator/simulation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "data/calibration/calibration.h"
#include "data/calibration/imu_calibration.h"
#include "data/core/error.h"
#include "data/io/file.h"
#include "data/simulator/ray_scene.h"
#include "data/source/sequence.h"
#include "tests/testing/box_room_renderer.h"
#include "tests/testing/small_scenes.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::MessageOf;

// Paints the frame's number, so that a test can tell which image is where.
class NumberPainter : public PairRenderer {
 public:
  explicit NumberPainter(const RenderTask& task) : size_(task.rig.cameras[0].width_px, 8) {}
  RenderedPair Render(int frame, bool with_depth) override {
    RenderedPair pair{cv::Mat(size_, CV_8U, cv::Scalar(frame)),
                      cv::Mat(size_, CV_8U, cv::Scalar(100 + frame)),
                      {}};
    if (with_depth) pair.depth_m = cv::Mat(size_, CV_32F, cv::Scalar(3 - 0.01 * frame));
    return pair;
  }
  void WriteTruth(const std::string& folder, int frames) override {
    WriteFile(folder + "/frames.txt", std::to_string(frames));
  }

 private:
  cv::Size size_;
};

class SimulationTest : public ::testing::Test {
 protected:
  void SetUp() override {
    options_.scene = folder_ + "/scene.yaml";
    options_.folder = folder_ + "/sequence";
    WriteFile(options_.scene,
              "trajectory: {kind: robot, waypoints_m: [[0, 0, 1], [2, 0, 1]], stand_still_s: 0.5, "
              "speed_m_s: 1.0}\n");
  }

  SimulationState Run(int most_pairs = 1000, const StageStarter& stage = {}) {
    fs::remove_all(options_.folder);
    return Simulate(
        options_, [](const RenderTask& task) { return std::make_unique<NumberPainter>(task); },
        [&](const SimulationState& state) { return state.pairs < most_pairs; }, stage);
  }

  Rig TrueRig() const {
    const std::string truth = options_.folder + "/truth/rig.yaml";
    Warnings warnings;
    return ReadKalibrCalibration(truth, truth, &warnings).rig;
  }

  const testing::TempFolder temp_;
  const std::string folder_ = temp_.Path();
  SimulationOptions options_;
};

TEST_F(SimulationTest, WritesASequenceThatTheReaderAccepts) {
  options_.with_depth = true;
  const SimulationState summary = Run();
  EXPECT_EQ(summary.pairs, summary.planned_pairs);
  EXPECT_NEAR(summary.distance_m, 2.0, 0.05);
  EXPECT_EQ(summary.nearest_pair, summary.pairs - 1);
  EXPECT_NEAR(summary.nearest_m, 3 - 0.01 * (summary.pairs - 1), 1e-5);
  const Sequence sequence = OpenSequence(options_.folder);
  ASSERT_EQ(static_cast<int>(sequence.images.size()), summary.pairs);
  EXPECT_TRUE(sequence.warnings.entries().empty());
  EXPECT_LT(sequence.imu.front().stamp_ns, sequence.images.front().stamp_ns - 50'000'000);
  EXPECT_GT(sequence.imu.back().stamp_ns, sequence.images.back().stamp_ns + 50'000'000);
  EXPECT_EQ(cv::imread(sequence.images[7].left_path, cv::IMREAD_UNCHANGED).at<uchar>(0), 7);
  EXPECT_EQ(cv::imread(sequence.images[7].right_path, cv::IMREAD_UNCHANGED).at<uchar>(0), 107);
  EXPECT_EQ(ReadFile(options_.folder + "/truth/frames.txt"), std::to_string(summary.pairs));
}

TEST_F(SimulationTest, RightImagesAndRowsOfTheirOwnTimesAreTold) {
  options_.right_offset_s = 0.008;
  options_.readout_s = 0.02;
  const SimulationState summary = Run();
  const Sequence sequence = OpenSequence(options_.folder);
  ASSERT_EQ(static_cast<int>(sequence.images.size()), summary.pairs);
  EXPECT_NEAR(sequence.rig.right_time_offset_s, 0.008, 1e-9);
  EXPECT_EQ(sequence.rig.readout_s[0], 0.02);
  EXPECT_EQ(sequence.rig.readout_s[1], 0.02);
  EXPECT_EQ(cv::imread(sequence.images[7].right_path, cv::IMREAD_UNCHANGED).at<uchar>(0), 107);
  EXPECT_EQ(TrueRig().readout_s[1], 0.02);
}

TEST_F(SimulationTest, ARigOfOneCameraHasImagesOfOne) {
  Rig rig = ReadSimulatedRig("euroc");
  rig.cameras[1] = Camera();
  options_.rig = folder_ + "/one.yaml";
  WriteKalibrCalibration(options_.rig, rig);
  Run();
  const Sequence sequence = OpenSequence(options_.folder);
  EXPECT_FALSE(HasTwoCameras(sequence.rig));
  EXPECT_EQ(cv::imread(sequence.images[7].left_path, cv::IMREAD_UNCHANGED).at<uchar>(0), 7);
  EXPECT_FALSE(fs::exists(options_.folder + "/mav0/cam1"));
}

TEST_F(SimulationTest, AWrongCalibrationIsToldButNotTrue) {
  options_.miscalibration = 1;
  Run();
  EXPECT_EQ(TrueRig().cameras[0].fx_px, 458.654);
  EXPECT_GT(std::abs(OpenSequence(options_.folder).rig.cameras[0].fx_px - 458.654), 0.05);
}

TEST_F(SimulationTest, AnImuThatMisreadsIsToldInTheTruthOnly) {
  Run();
  const Sequence exact = OpenSequence(options_.folder);
  options_.imu_scale = {0.03, -0.02};
  options_.imu_axes_deg = 0.5;
  Run();
  const Sequence raw = OpenSequence(options_.folder);
  EXPECT_TRUE(IsIdentity(raw.rig.imu_correction));
  EXPECT_NEAR(raw.imu[0].specific_force_m_s2.norm() / exact.imu[0].specific_force_m_s2.norm(), 1.03,
              0.01);
  SequenceOptions told;
  told.calibration = options_.folder + "/truth/rig.yaml";
  const Sequence corrected = OpenSequence(options_.folder, told);
  const ImuSample &a = corrected.imu[99], &b = exact.imu[99];
  EXPECT_LT((a.specific_force_m_s2 - b.specific_force_m_s2).norm(), 1e-8);
  EXPECT_LT((a.angular_velocity_rad_s - b.angular_velocity_rad_s).norm(), 1e-8);
}

TEST_F(SimulationTest, KeepsWhatIsDoneWhenItIsEndedEarly) {
  const SimulationState summary = Run(0);
  EXPECT_LT(summary.pairs, summary.planned_pairs);
  const std::string images = ReadFile(options_.folder + "/mav0/cam1/data.csv");
  EXPECT_EQ(std::count(images.begin(), images.end(), '\n'), 1 + summary.pairs);
}

TEST_F(SimulationTest, EachBuildingHasItsOwnImuBiases) {
  const std::string motion = ReadFile(options_.scene);
  const auto imu_of = [&](const std::string& name, int64_t seed) {
    WriteFile(options_.scene, "name: " + name + "\n" + motion);
    options_.seed = seed;
    Run();
    return ReadFile(options_.folder + "/mav0/imu0/data.csv");
  };
  const std::string hall = imu_of("hall", 1);
  EXPECT_NE(imu_of("attic", 1), hall);
  EXPECT_NE(imu_of("hall", 2), hall);
  EXPECT_EQ(imu_of("hall", 1), hall);
}

TEST_F(SimulationTest, IsEndedBeforeItsFirstPairWithoutATrace) {
  for (const std::string ended : {"planning the motion", "IMU", "truth"}) {
    const auto stage = [&](const std::string& label) {
      return Progress([go_on = label != ended](double) { return go_on; });
    };
    EXPECT_THROW(Run(1000, stage), StoppedError) << ended;
    EXPECT_FALSE(fs::exists(options_.folder + "/mav0")) << ended;
    EXPECT_FALSE(fs::exists(options_.folder + "/truth")) << ended;
  }
}

TEST_F(SimulationTest, RefusesWhatMakesNoSenseOrFitsOnNoDisk) {
  const SimulationOptions good = options_;
  const auto expect_error = [&](const auto& change, const std::string& what) {
    options_ = good;
    change();
    EXPECT_THAT(MessageOf<ConfigError>([this] { Run(); }), HasSubstr(what));
  };
  expect_error([&] { options_.seed = -1; }, "--seed: found -1");
  // As 0, images would have the noise of another seed.
  expect_error([&] { options_.seed = int64_t{1} << 32; },
               "--seed: found 4294967296, expected 0 to 4294967295");
  expect_error([&] { options_.image_rate_hz = 0; }, "--rate: found 0, expected 0.01 to 1000");
  expect_error([&] { options_.image_rate_hz = 1e-300; },
               "--rate: found 1e-300, expected 0.01 to 1000");
  expect_error([&] { options_.image_rate_hz = 0.05; },
               "expected at least 20.1 s, which a pair takes at --rate 0.05 Hz");
  expect_error([&] { options_.from_s = 1e300; }, "--from: found 1e+300 s, expected less than the ");
  const std::string way = "trajectory: {kind: robot, waypoints_m: [[0, 0, 1], [2, 0, 1]], ";
  WriteFile(options_.scene, way + "stand_still_s: 300}\n");
  expect_error([&] { options_.image_rate_hz = 1000; }, "pairs at 1000 Hz, expected at most 500000");
  WriteFile(options_.scene, "walls: []\n");
  EXPECT_THROW(Run(), ConfigError);
}

// Images, depth, stamps, calibration and true poses of a written sequence against each other, as a
// user reads them: a pixel moved by depth and poses finds its own grey value.

// EuRoC's rig at a quarter of its resolution, with its distortion.
constexpr const char* kSmallRig = R"(
cam0: {camera_model: pinhole, intrinsics: [114.66, 114.32, 91.43, 61.72],
       distortion_model: radtan, distortion_coeffs: [-0.283, 0.074, 0.0002, 1.8e-05],
       resolution: [188, 120], T_imu_cam: [[0, -1, 0, -0.02], [1, 0, 0, -0.06], [0, 0, 1, 0.01], [0, 0, 0, 1]]}
cam1: {camera_model: pinhole, intrinsics: [114.40, 114.03, 94.62, 63.43],
       distortion_model: equidistant, distortion_coeffs: [-0.01, 0.002, 0.0, 0.0],
       resolution: [188, 120], T_imu_cam: [[0, -1, 0, -0.02], [1, 0, 0, 0.05], [0, 0, 1, 0.01], [0, 0, 0, 1]]}
imu0: {gyroscope_noise_density: 1.7e-4, gyroscope_random_walk: 2e-5,
       accelerometer_noise_density: 2e-3, accelerometer_random_walk: 3e-3, update_rate: 200}
)";

class ImageConsistencyTest : public ::testing::Test {
 protected:
  void SetUp() override {
    WriteFile(folder_ + "/rig.yaml", kSmallRig);
    WriteFile(folder_ + "/scene.yaml",
              "trajectory: {kind: walk, waypoints_m: [[0, 0, 1.5], [3, 0, 1.5], [3, 3, 1.5]]}\n");
    SimulationOptions options;
    options.scene = folder_ + "/scene.yaml";
    options.rig = folder_ + "/rig.yaml";
    options.folder = folder_ + "/sequence";
    options.from_s = 4.2;
    options.duration_s = 2.0;
    options.time_offset_s = 0.04;
    options.with_depth = true;
    Simulate(
        options,
        [](const RenderTask& task) { return std::make_unique<BoxRoomRenderer>(task, 2.0); },
        [](const SimulationState&) { return true; });
    sequence_ = OpenSequence(options.folder);
    truth_ = ReadTrajectory(sequence_.truth_path);
    Warnings warnings;
    const std::string rig_path = options.folder + "/truth/rig.yaml";
    rig_ = ReadKalibrCalibration(rig_path, rig_path, &warnings).rig;
  }

  RigidTransform CameraAt(int64_t stamp_ns, int camera) const {
    const int64_t imu_stamp_ns = stamp_ns + ToNanoseconds(rig_.camera_time_offset_s);
    return *PoseAt(truth_, imu_stamp_ns) * rig_.T_imu_camera[camera];
  }

  // The median difference of grey values between the left image `from` and an image of pair `to`,
  // each pixel moved by its depth and the true poses.
  double MedianDifference(size_t from, size_t to, int camera) const {
    const StereoEntry &a = sequence_.images[from], &b = sequence_.images[to];
    const cv::Mat left = cv::imread(a.left_path, cv::IMREAD_UNCHANGED);
    const cv::Mat depth_mm =
        cv::imread(folder_ + "/sequence/truth/depth/" + std::to_string(a.stamp_ns) + ".png",
                   cv::IMREAD_UNCHANGED);
    const cv::Mat other =
        cv::imread(camera == 0 ? b.left_path : b.right_path, cv::IMREAD_UNCHANGED);
    const RigidTransform T_b_a = CameraAt(b.stamp_ns, camera).Inverse() * CameraAt(a.stamp_ns, 0);
    std::vector<double> differences;
    for (int y = 4; y < left.rows - 4; y += 2) {
      for (int x = 4; x < left.cols - 4; x += 2) {
        const Eigen::Vector3d ray = *rig_.cameras[0].Unproject(Eigen::Vector2d(x, y));
        const Eigen::Vector3d p = ray / ray.z() * depth_mm.at<uint16_t>(y, x) * 1e-3;
        const auto pixel = rig_.cameras[camera].Project(T_b_a * p);
        if (!pixel || !rig_.cameras[camera].Contains(*pixel, 2)) continue;
        differences.push_back(std::abs(Interpolated(other, *pixel) - left.at<uchar>(y, x)));
      }
    }
    if (differences.size() < 1000) return 255;
    std::nth_element(differences.begin(), differences.begin() + differences.size() / 2,
                     differences.end());
    return differences[differences.size() / 2];
  }

  static double Interpolated(const cv::Mat& image, const Eigen::Vector2d& p) {
    const int x = static_cast<int>(p.x()), y = static_cast<int>(p.y());
    const double u = p.x() - x, v = p.y() - y;
    return (1 - v) * ((1 - u) * image.at<uchar>(y, x) + u * image.at<uchar>(y, x + 1)) +
           v * ((1 - u) * image.at<uchar>(y + 1, x) + u * image.at<uchar>(y + 1, x + 1));
  }

  const testing::TempFolder temp_;
  const std::string folder_ = temp_.Path();
  Sequence sequence_;
  Trajectory truth_;
  Rig rig_;
};

TEST_F(ImageConsistencyTest, PixelsFindThemselvesInOtherImages) {
  for (const size_t from : {2, 12, 22}) {
    EXPECT_LT(MedianDifference(from, from, 1), 2.0) << "right";
    EXPECT_LT(MedianDifference(from, from + 1, 0), 2.0) << "next";
    EXPECT_LT(MedianDifference(from, from + 6, 1), 3.0) << "right, 0.3 s later";
  }
  // The measure notices a wrong time offset where the walk turns.
  rig_.camera_time_offset_s = 0;
  EXPECT_GT(MedianDifference(12, 18, 1), 10.0);
}

// A floor of 10 x 10 m around the origin, with a wall across it at x_m.
Scene FloorWithWall(float x_m) {
  Scene scene;
  scene.materials = {{TextureKind::kPlain, 0.5f, 0, 1}};
  scene.quads = {{{-5, -5, -1}, {10, 0, 0}, {0, 10, 0}, 0, {0, 0}},
                 {{x_m, -5, -1}, {0, 10, 0}, {0, 0, 3}, 0, {0, 0}}};
  return scene;
}

// From 0 m on along x, at `speed_m_s`, for two seconds.
RenderTask Along(double speed_m_s) {
  return testing::SlidingTask(testing::SmallRig(Distortion::kNone), testing::LookingAlongX(),
                              {speed_m_s, 0, 0}, 20);
}

TEST(CheckWay, SaysWhereItPassesThroughAWallOrGlass) {
  EXPECT_EQ(CheckWay(FloorWithWall(4), Along(1)).count, 0);
  const WayCrossings crossings = CheckWay(FloorWithWall(0.51f), Along(1));
  EXPECT_EQ(crossings.count, 1);
  EXPECT_NEAR(crossings.first_s, 1.55, 0.06);
  EXPECT_NEAR(crossings.first_place_m.x(), 0.55, 0.06);
  Scene scene = FloorWithWall(4);
  scene.panes = {{{0.51f, -5, -1}, {0, 10, 0}, {0, 0, 3}}};
  EXPECT_EQ(CheckWay(scene, Along(1)).count, 1);
}

TEST(CheckWay, SaysWhereItLeavesTheBuilding) {
  EXPECT_THAT(testing::MessageOf<ConfigError>([] { CheckWay(FloorWithWall(4), Along(8)); }),
              AllOf(HasSubstr("s into the motion the left camera is at (5."),
                    HasSubstr("outside the building"), HasSubstr("(-5.00, -5.00, -1.00)")));
}

}  // namespace
}  // namespace slcmap
