#include "data/simulator/sequence_writer.h"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "data/error.h"
#include "data/simulator/example.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kStart_ns = 1'400'000'000'000'000'000;

class SequenceWriterTest : public testing::Test {
 protected:
  void SetUp() override { fs::remove_all(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  const std::string folder_ = testing::TempDir() + "sequence_writer_" +
                              testing::UnitTest::GetInstance()->current_test_info()->name();
  const Rig rig_ = ExampleStereoRig();
  const MotionSpline motion_ = ExampleFlight(rig_, 1.0);
};

TEST_F(SequenceWriterTest, TruthComesBackAsItWas) {
  ImuSimulatorOptions options;
  options.start_stamp_ns = kStart_ns;
  SequenceWriter writer(folder_);
  writer.WriteTruth(motion_, SimulateImu(motion_, options), kStart_ns);
  for (const char* file : {"/mav0/state_groundtruth_estimate0/data.csv", "/truth/trajectory.tum"}) {
    const Trajectory truth = ReadTrajectory(folder_ + file);
    ASSERT_EQ(truth.size(), 201u);
    EXPECT_EQ(truth[0].stamp_ns, kStart_ns);
    const RigidTransform expected = motion_.PoseAt(0.5), found = truth[100].T_world_imu;
    EXPECT_LT((expected.translation - found.translation).norm(), 1e-8);
    EXPECT_LT(LogRotation(expected.rotation.conjugate() * found.rotation).norm(), 1e-8);
  }
}

TEST_F(SequenceWriterTest, CalibrationIsInAslForm) {
  SequenceWriter(folder_).WriteCalibration(rig_, 20);
  const YAML::Node camera = YAML::LoadFile(folder_ + "/mav0/cam1/sensor.yaml");
  EXPECT_EQ(camera["intrinsics"].as<std::vector<double>>(),
            std::vector<double>({435, 435, 375.5, 239.5}));
  EXPECT_EQ(camera["resolution"].as<std::vector<int>>(), std::vector<int>({752, 480}));
  const auto data = camera["T_BS"]["data"].as<std::vector<double>>();
  ASSERT_EQ(data.size(), 16u);
  EXPECT_EQ(data[7], rig_.T_imu_camera[1].translation.y());
  const YAML::Node imu = YAML::LoadFile(folder_ + "/mav0/imu0/sensor.yaml");
  EXPECT_EQ(imu["gyroscope_noise_density"].as<double>(), rig_.imu_noise.gyro_noise_rad_s_sqrthz);
}

TEST_F(SequenceWriterTest, ImagesAndDepthKeepTheirValues) {
  SequenceWriter writer(folder_);
  writer.WriteImage(1, kStart_ns, cv::Mat(4, 6, CV_8U, cv::Scalar(77)));
  writer.WriteDepth(kStart_ns, cv::Mat(4, 6, CV_32F, cv::Scalar(2.345)));
  writer.WriteImageLists({kStart_ns});
  const std::string name = std::to_string(kStart_ns) + ".png";
  const cv::Mat image = cv::imread(folder_ + "/mav0/cam1/data/" + name, cv::IMREAD_UNCHANGED);
  ASSERT_EQ(image.type(), CV_8U);
  EXPECT_EQ(image.at<uchar>(3, 5), 77);
  const cv::Mat depth = cv::imread(folder_ + "/truth/depth/" + name, cv::IMREAD_UNCHANGED);
  ASSERT_EQ(depth.type(), CV_16U);
  EXPECT_EQ(depth.at<uint16_t>(3, 5), 2345);
}

TEST_F(SequenceWriterTest, RefusesToWriteOverASequence) {
  SequenceWriter first(folder_);
  EXPECT_THROW(SequenceWriter second(folder_), OutputError);
}

}  // namespace
}  // namespace slcmap
