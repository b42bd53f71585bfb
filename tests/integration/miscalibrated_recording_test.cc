// Recordings that tests/benchmarks/miscalibrate.py makes from good ones, as slcmap reads them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <sstream>

#include "data/calibration/calibration.h"
#include "data/core/math.h"
#include "data/source/asl_files.h"
#include "tests/integration/slcmap_process.h"
#include "tests/testing/small_sequence.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using testing::RunShell;
using testing::TempFolder;

class MiscalibratedRecording : public ::testing::Test {
 protected:
  void SetUp() override {
    if (RunShell("/usr/bin/python3 -c 'import numpy'").exit_code != 0) {
      GTEST_SKIP() << "python3-numpy is not here: tests/install_readers.sh";
    }
    testing::WriteSequence(good_folder_, testing::SmallSequence());
    std::string imu = "#timestamp [ns],wx,wy,wz,ax,ay,az\n";
    for (int64_t i = 0; i < 60; ++i) {  // whose values change
      imu += fmt::format("{},0.{},0.{},-0.{},0.{},-0.{},9.{}\n",
                         testing::kFirstStamp_ns + i * testing::kImuStep_ns, i + 1, i + 2, i + 3,
                         i + 4, i + 5, i + 6);
    }
    good_folder_.Write("mav0/imu0/data.csv", imu);
  }

  testing::ProcessResult Make(const std::string& arguments) const {
    return RunShell("/usr/bin/python3 " SLCMAP_SOURCE_DIR "/tests/benchmarks/miscalibrate.py " +
                    arguments);
  }
  // A recording with these options.
  std::string Made(const std::string& name, const std::string& options) const {
    const testing::ProcessResult result = Make(good_ + " " + folder_.Path(name) + " " + options);
    EXPECT_EQ(result.exit_code, 0) << result.error;
    return folder_.Path(name) + "/mav0";
  }
  Rig RigOf(const std::string& mav) const {
    Warnings warnings;
    return ReadAslCalibration(mav, &warnings).rig;
  }

  const TempFolder good_folder_, folder_;
  const std::string good_ = good_folder_.Path();
};

TEST_F(MiscalibratedRecording, ClaimsWhatItsOptionsSay) {
  const Rig good = RigOf(good_ + "mav0");
  const Rig rig = RigOf(Made("off",
                             "--right-rotation-deg 0.05 0.02 0 --imu-rotation-deg 0 1 0 "
                             "--focal-scale 1.003 --principal-px 1 -2 --timeshift-ms -10"));
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(kDegree, Vector3d::UnitY()));
  EXPECT_LT(rig.T_imu_camera[0].rotation.angularDistance(turn * good.T_imu_camera[0].rotation),
            1e-9);
  EXPECT_LT((rig.T_imu_camera[0].translation - turn * good.T_imu_camera[0].translation).norm(),
            1e-9);
  const Eigen::Quaterniond right =
      good.T_imu_camera[1].rotation.inverse() * turn.inverse() * rig.T_imu_camera[1].rotation;
  EXPECT_LT((LogRotation(right) / kDegree - Vector3d(0.05, 0.02, 0)).norm(), 1e-9);
  EXPECT_NEAR(rig.cameras[0].fx_px, 1.003 * good.cameras[0].fx_px, 1e-9);
  EXPECT_NEAR(rig.cameras[1].cx_px, good.cameras[1].cx_px + 1, 1e-9);
  EXPECT_NEAR(rig.cameras[1].cy_px, good.cameras[1].cy_px - 2, 1e-9);
  EXPECT_NEAR(rig.camera_time_offset_s, -0.01, 1e-12);
}

TEST_F(MiscalibratedRecording, LateStampsAreThoseOfTheSameImages) {
  Warnings warnings;
  const auto good = ReadAslImages(good_ + "mav0/cam1", &warnings);
  const auto late = ReadAslImages(Made("late", "--time-offset-ms 10") + "/cam1", &warnings);
  ASSERT_EQ(late.size(), good.size());
  for (size_t i = 0; i < good.size(); ++i) {
    EXPECT_EQ(late[i].stamp_ns, good[i].stamp_ns + 10'000'000);
    EXPECT_TRUE(std::filesystem::equivalent(late[i].path, good[i].path));
  }
}

TEST_F(MiscalibratedRecording, AddsBiasesToTheSamplesOfTheImu) {
  const auto samples = [](const std::string& mav) {
    Warnings warnings;
    return ReadAslImu(mav + "/imu0/data.csv", &warnings);
  };
  const auto good = samples(good_ + "mav0");
  const auto biased =
      samples(Made("biased", "--gyro-bias-rad-s 0.01 0 0 --accel-bias-m-s2 0 0 -0.1"));
  const auto drawn = samples(Made("drawn", "--imu-bias-seed 1"));
  const auto other = samples(Made("other", "--imu-bias-seed 2"));
  ASSERT_EQ(biased.size(), good.size());
  for (size_t i = 0; i < good.size(); ++i) {
    EXPECT_LT(
        (biased[i].angular_velocity_rad_s - good[i].angular_velocity_rad_s - Vector3d(0.01, 0, 0))
            .norm(),
        1e-9);
    EXPECT_LT(
        (biased[i].specific_force_m_s2 - good[i].specific_force_m_s2 + Vector3d(0, 0, 0.1)).norm(),
        1e-9);
    // The same for all samples, by the seed.
    const Vector3d bias = drawn[i].specific_force_m_s2 - good[i].specific_force_m_s2;
    EXPECT_LT((bias - (drawn[0].specific_force_m_s2 - good[0].specific_force_m_s2)).norm(), 1e-9);
    EXPECT_GT((bias - (other[i].specific_force_m_s2 - good[i].specific_force_m_s2)).norm(), 1e-3);
  }
}

TEST_F(MiscalibratedRecording, NamesManyFaultsAndMakesEachButNoneThatItDoesNotKnow) {
  const std::string out = folder_.Path("out");
  EXPECT_EQ(Make(good_ + " " + out + " --fault none-such").exit_code, 2);
  EXPECT_FALSE(std::filesystem::exists(out));
  const std::string list = Make("--list-faults").output;
  EXPECT_GE(std::count(list.begin(), list.end(), '\n'), 25);
  const std::string faults = folder_.Path("faults");
  const testing::ProcessResult made = Make(good_ + " " + faults + " --all-faults");
  EXPECT_EQ(made.exit_code, 0) << made.error;
  const auto text = [](const std::string& mav) {
    std::string all;
    for (const char* name : {"cam0/sensor.yaml", "cam1/sensor.yaml", "cam0/data.csv",
                             "cam1/data.csv", "imu0/data.csv"}) {
      all += testing::ReadText(mav + "/" + name);
    }
    return all + std::filesystem::canonical(mav + "/cam0/data").string();
  };
  std::set<std::string> texts = {text(good_ + "mav0")};
  std::istringstream lines(list);
  for (std::string name, words; lines >> name && std::getline(lines, words);) {
    EXPECT_TRUE(texts.insert(text(faults + "/" + name + "/mav0")).second) << name;
  }
}

}  // namespace
}  // namespace slcmap
