// Images, depth, stamps, calibration and true poses of a written sequence against each other, as a
// user reads them: a pixel moved by depth and poses finds its own grey value.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "data/calibration/calibration.h"
#include "data/io/file.h"
#include "data/simulator/simulation.h"
#include "data/source/sequence.h"
#include "tests/testing/box_room_renderer.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;

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
    fs::remove_all(folder_);
    fs::create_directories(folder_);
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
  void TearDown() override { fs::remove_all(folder_); }

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

  const std::string folder_ = ::testing::TempDir() + "image_consistency";
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

TEST_F(ImageConsistencyTest, TheGyroscopeTurnsAsTheTruthDoes) {
  ASSERT_EQ(truth_.size(), sequence_.imu.size());
  Eigen::Quaterniond turned = truth_.front().T_world_imu.rotation;
  double turn_rad = 0;
  for (size_t i = 0; i + 1 < truth_.size(); ++i) {
    const Eigen::Vector3d rate = 0.5 * (sequence_.imu[i].angular_velocity_rad_s +
                                        sequence_.imu[i + 1].angular_velocity_rad_s);
    turned = turned * ExpRotation(rate * 0.005);
    turn_rad += rate.norm() * 0.005;
  }
  const Eigen::Vector3d error =
      LogRotation(turned.conjugate() * truth_.back().T_world_imu.rotation);
  // The bias of some 0.02 rad/s over two seconds is all that is between the two.
  EXPECT_LT(error.norm(), 0.15);
  EXPECT_GT(turn_rad, 0.5);
}

}  // namespace
}  // namespace slcmap
