#include "data/simulator/sequence_writer.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "data/source/sequence.h"
#include "tests/testing/example.h"

namespace slcmap {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kStart_ns = 1'400'000'000'000'000'000;

class SequenceWriterTest : public ::testing::Test {
 protected:
  void SetUp() override { fs::remove_all(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  static void ExpectSameRig(const Rig& found, const Rig& expected) {
    for (const int c : {0, 1}) {
      EXPECT_EQ(found.cameras[c].distortion, expected.cameras[c].distortion);
      EXPECT_EQ(found.cameras[c].coefficients, expected.cameras[c].coefficients);
      EXPECT_EQ(found.cameras[c].fy_px, expected.cameras[c].fy_px);
      EXPECT_EQ(found.cameras[c].width_px, expected.cameras[c].width_px);
      const Eigen::Matrix4d error =
          found.T_imu_camera[c].Matrix() - expected.T_imu_camera[c].Matrix();
      EXPECT_LT(error.cwiseAbs().maxCoeff(), 1e-12);
    }
    EXPECT_EQ(found.camera_time_offset_s, expected.camera_time_offset_s);
    EXPECT_EQ(found.imu_noise.gyro_walk_rad_s2_sqrthz, expected.imu_noise.gyro_walk_rad_s2_sqrthz);
  }

  const std::string folder_ = ::testing::TempDir() + "sequence_writer_" +
                              ::testing::UnitTest::GetInstance()->current_test_info()->name();
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

TEST_F(SequenceWriterTest, TheReaderFindsWhatWasWritten) {
  ImuSimulatorOptions options;
  options.start_stamp_ns = kStart_ns;
  const SimulatedImu imu = SimulateImu(motion_, options);
  const SequenceWriter writer(folder_);
  writer.WriteCalibration(rig_, 20);
  writer.WriteImu(imu.samples);
  writer.WriteImageLists({kStart_ns + 100'000'000, kStart_ns + 150'000'000});
  const Sequence sequence = OpenSequence(folder_);
  EXPECT_EQ(sequence.images.size(), 2u);
  EXPECT_EQ(sequence.images[1].stamp_ns, kStart_ns + 150'000'000);
  ASSERT_EQ(sequence.imu.size(), imu.samples.size());
  EXPECT_LT((sequence.imu[99].specific_force_m_s2 - imu.samples[99].specific_force_m_s2).norm(),
            1e-8);
  ExpectSameRig(sequence.rig, rig_);
}

TEST_F(SequenceWriterTest, TheTrueRigIsInKalibrsForm) {
  Rig rig = rig_;
  rig.camera_time_offset_s = 0.015;
  rig.cameras[1].distortion = Distortion::kEquidistant;
  rig.cameras[1].coefficients = {0.003, 0.001, -0.002, 0.0002};
  SequenceWriter(folder_).WriteTrueRig(rig);
  const std::string path = folder_ + "/truth/rig.yaml";
  Warnings warnings;
  ExpectSameRig(ReadKalibrCalibration(path, path, &warnings).rig, rig);
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
