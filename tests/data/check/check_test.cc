#include "data/check/check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <numbers>
#include <random>
#include <sstream>

#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/image.h"
#include "data/source/asl_source.h"
#include "tests/testing/shared_data.h"
#include "tests/testing/small_sequence.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;
using testing::TempFolder;

// The finding of a name; nullptr where there is none.
const CheckFinding* Find(const CheckReport& report, const std::string& name) {
  for (const CheckFinding& finding : report.findings) {
    if (finding.name == name) return &finding;
  }
  return nullptr;
}

TEST(CheckReport, NamesTheCamerasThatAreUsed) {
  CheckReport report;
  report.cameras = {"cam1", "cam2"};
  EXPECT_EQ(report.Named("swap cam0 and cam1, not cam10"), "swap cam1 and cam2, not cam10");
}

void ExpectFinding(const CheckReport& report, const std::string& name, Severity severity,
                   const std::string& remedy) {
  const CheckFinding* finding = Find(report, name);
  ASSERT_NE(finding, nullptr) << name << "\n" << CheckTable(report);
  EXPECT_EQ(finding->severity, severity) << CheckTable(report);
  EXPECT_THAT(finding->remedy, HasSubstr(remedy));
}

// Three seconds of turning by 0.5 rad/s about the x axis, with gravity turning as it must.
std::vector<ImuSample> TurningImu(double gyro_unit, double accel_unit) {
  std::vector<ImuSample> samples;
  for (int i = 0; i < 600; ++i) {
    const double t_s = 0.005 * i, angle_rad = 0.5 * t_s, noise = 1e-4 * (i % 7);
    samples.push_back(
        {i * testing::kImuStep_ns, Eigen::Vector3d(0.5 + noise, noise, noise) * gyro_unit,
         Eigen::Vector3d(noise, std::sin(angle_rad), std::cos(angle_rad)) * 9.81 * accel_unit});
  }
  return samples;
}

CheckReport CheckOfImu(double gyro_unit, double accel_unit) {
  CheckReport report;
  CheckImu(TurningImu(gyro_unit, accel_unit), &report);
  return report;
}

TEST(CheckImu, TellsUnitsApart) {
  EXPECT_TRUE(CheckOfImu(1, 1).findings.empty());
  ExpectFinding(CheckOfImu(1, 1 / 9.81), "imu-units", Severity::kError, "9.80665");
  ExpectFinding(CheckOfImu(180 / std::numbers::pi, 1), "imu-units", Severity::kError, "deg/s");
  ExpectFinding(CheckOfImu(1, 0.01), "imu-gravity", Severity::kError, "raw accelerometer");
}

TEST(CheckImu, NamesDeadAndFrozenAxes) {
  std::vector<ImuSample> samples = TurningImu(1, 1);
  for (size_t i = 0; i < samples.size(); ++i) {
    samples[i].angular_velocity_rad_s.z() = 0;
    if (i >= 300) samples[i].specific_force_m_s2.x() = 0.5;
  }
  CheckReport report;
  CheckImu(samples, &report);
  ExpectFinding(report, "gyro-dead", Severity::kError, "gyroscope");
  EXPECT_THAT(Find(report, "gyro-dead")->found, HasSubstr("z is 0 for 3.0 s, while"));
  ExpectFinding(report, "accel-dead", Severity::kError, "accelerometer");
  EXPECT_THAT(Find(report, "accel-dead")->found, HasSubstr("x is 0.5 for 1.5 s"));
}

TEST(CheckImu, NamesSwappedColumns) {
  std::vector<ImuSample> samples = TurningImu(1, 1);
  for (ImuSample& sample : samples) {
    std::swap(sample.angular_velocity_rad_s, sample.specific_force_m_s2);
  }
  CheckReport report;
  CheckImu(samples, &report);
  ExpectFinding(report, "imu-columns", Severity::kError, "swapped");
}

TEST(CheckImu, NamesAbsurdValues) {
  std::vector<ImuSample> samples = TurningImu(1, 1);
  samples[100].specific_force_m_s2.x() = 1e6;
  samples[200].angular_velocity_rad_s.z() = -500;
  CheckReport report;
  CheckImu(samples, &report);
  ExpectFinding(report, "imu-values", Severity::kWarning, "driver");
  EXPECT_THAT(Find(report, "imu-values")->found, HasSubstr("2 of 600 samples"));
  for (ImuSample& sample : samples) sample.angular_velocity_rad_s *= 1e4;
  CheckReport worse;
  CheckImu(samples, &worse);
  ExpectFinding(worse, "imu-values", Severity::kError, "units");
}

Rig SideBySide() {
  Rig rig;
  for (Camera& camera : rig.cameras) {
    camera = {
        .width_px = 640, .height_px = 480, .fx_px = 400, .fy_px = 400, .cx_px = 320, .cy_px = 240};
  }
  // Camera x is the IMU's -y, camera y its -z: looking along the IMU's x.
  Eigen::Matrix3d R_imu_camera;
  R_imu_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const Eigen::Quaterniond q(R_imu_camera);
  rig.T_imu_camera = {RigidTransform(q, {0.05, 0.06, 0}), RigidTransform(q, {0.05, -0.06, 0})};
  return rig;
}

TEST(CheckCalibration, NamesSwappedAndInvertedRigs) {
  CheckReport good, swapped, inverted;
  Rig rig = SideBySide();
  CheckStereoRig(rig, &good);
  EXPECT_TRUE(good.findings.empty()) << CheckTable(good);
  std::swap(rig.T_imu_camera[0], rig.T_imu_camera[1]);
  CheckStereoRig(rig, &swapped);
  ExpectFinding(swapped, "left-right", Severity::kError, "swap cam0 and cam1");
  rig = SideBySide();
  for (RigidTransform& T : rig.T_imu_camera) T = T.Inverse();
  CheckStereoRig(rig, &inverted);
  ExpectFinding(inverted, "extrinsics-direction", Severity::kError, "inverted");
}

class CheckSmallSequence : public ::testing::Test {
 protected:
  void WriteImage(int camera, int index, const cv::Mat& image) {
    cv::imwrite(
        folder_.Path(fmt::format("mav0/cam{}/data/{}.png", camera, testing::ImageStamp(index))),
        image);
  }
  TempFolder folder_;
};

TEST_F(CheckSmallSequence, AFolderThatIsNoSequenceIsOneFinding) {
  const CheckReport report = CheckSequence(folder_.Path());
  EXPECT_FALSE(report.Usable());
  ExpectFinding(report, "unreadable", Severity::kError, "mav0/cam0");
}

TEST_F(CheckSmallSequence, AFrozenCameraIsNamed) {
  testing::WriteSequence(folder_, {.images = 12, .still = true});
  ExpectFinding(CheckSequence(folder_.Path()), "frozen-camera", Severity::kError, "hangs");
}

TEST_F(CheckSmallSequence, AShortHangIsNamedWithItsTime) {
  testing::WriteSequence(folder_, {.images = 60});
  for (int i = 31; i < 37; ++i) WriteImage(1, i, testing::Texture(30, 4));
  const CheckReport report = CheckSequence(folder_.Path());
  ExpectFinding(report, "frozen-camera", Severity::kWarning, "hangs");
  EXPECT_EQ(Find(report, "frozen-camera")->found,
            fmt::format("6 of 60 images of cam1 repeat the one before, the longest time 0.30 s "
                        "from stamp {}",
                        testing::ImageStamp(30)));
}

TEST_F(CheckSmallSequence, ASecondCameraIsNotNeeded) {
  testing::WriteSequence(folder_, {.images = 12});
  std::filesystem::remove_all(folder_.Path("mav0/cam1"));
  const CheckReport report = CheckSequence(folder_.Path());
  EXPECT_EQ(Find(report, "unreadable"), nullptr) << CheckTable(report);
  EXPECT_EQ(Find(report, "images-missing"), nullptr) << CheckTable(report);
  EXPECT_EQ(Find(report, "same-images"), nullptr) << CheckTable(report);
  EXPECT_NE(Find(report, "one-camera"), nullptr) << CheckTable(report);
}

TEST_F(CheckSmallSequence, ABlackCameraIsNamed) {
  testing::WriteSequence(folder_, {.images = 12});
  for (int i = 0; i < 12; ++i) WriteImage(1, i, cv::Mat::zeros(64, 96, CV_8U));
  const CheckReport report = CheckSequence(folder_.Path());
  ExpectFinding(report, "black-camera", Severity::kError, "lens");
  EXPECT_THAT(Find(report, "black-camera")->found, HasSubstr("cam1"));
}

TEST_F(CheckSmallSequence, ExposureThatSwingsIsNamedFromWhenOn) {
  testing::WriteSequence(folder_, {.images = 60});
  EXPECT_EQ(Find(CheckSequence(folder_.Path()), "exposure"), nullptr);
  for (int i = 30; i < 60; i += 2) WriteImage(1, i, 0.5 * testing::Texture(i, 4));
  const CheckReport report = CheckSequence(folder_.Path());
  ExpectFinding(report, "exposure", Severity::kWarning, "hold exposure");
  EXPECT_THAT(Find(report, "exposure")->found,
              ::testing::AllOf(HasSubstr("of cam1 swings by up to 2"),
                               HasSubstr("16 of 30 sampled places, from about 1.4 s on")));
}

TEST_F(CheckSmallSequence, ImagesOfOtherPlacesDoNotTellOfExposure) {
  testing::WriteSequence(folder_, {.images = 60});
  std::string rows;
  for (int i = 0; i < 60; ++i) {
    if (i >= 30 && i % 2 == 0) WriteImage(1, i, 0.5 * testing::Texture(i, 4));
    rows += fmt::format("{},{}.png\n", testing::kFirstStamp_ns + i * 1'000'000'000LL,
                        testing::ImageStamp(i));
  }
  for (const int camera : {0, 1}) {
    folder_.Write(fmt::format("mav0/cam{}/data.csv", camera), rows);
  }
  EXPECT_EQ(Find(CheckSequence(folder_.Path()), "exposure"), nullptr);
}

TEST_F(CheckSmallSequence, ImagesOfAnotherSizeAreNamed) {
  testing::WriteSequence(folder_, {.images = 12});
  for (int i = 0; i < 12; ++i) {
    for (int camera = 0; camera < 2; ++camera) {
      WriteImage(camera, i, testing::Texture(i, 0, {128, 96}));
    }
  }
  ExpectFinding(CheckSequence(folder_.Path()), "images", Severity::kError, "calibrate");
}

TEST_F(CheckSmallSequence, WhatLeavesNoPairsIsAnError) {
  testing::WriteSequence(folder_, {.images = 40});
  for (int i = 0; i < 40; ++i) {
    const int camera = i % 2;  // of no camera more than half
    if (i >= 30) continue;
    std::filesystem::remove(
        folder_.Path(fmt::format("mav0/cam{}/data/{}.png", camera, testing::ImageStamp(i))));
  }
  const CheckReport apart = CheckSequence(folder_.Path());
  ExpectFinding(apart, "images-unusable", Severity::kError, "mend");
  EXPECT_THAT(Find(apart, "images-unusable")->found, HasSubstr("30 of 40 pairs"));
  for (int i = 0; i < 40; ++i) {
    WriteImage(0, i, testing::Texture(i, 0));
    std::filesystem::remove(
        folder_.Path(fmt::format("mav0/cam1/data/{}.png", testing::ImageStamp(i))));
  }
  const CheckReport right = CheckSequence(folder_.Path());
  ExpectFinding(right, "images-missing", Severity::kError, "copy");
  EXPECT_THAT(Find(right, "images-missing")->found, HasSubstr("40 of 40 images of cam1"));
  Sequence sequence = OpenSequence(folder_.Path());
  AslSource source(sequence);
  ExpectFinding(CheckStart(&source, sequence.imu), "images-missing", Severity::kError, "copy");
  sequence.rig.cameras[1] = Camera();  // as odometry of one camera has it
  AslSource left(sequence);
  EXPECT_EQ(Find(CheckStart(&left, sequence.imu), "images-missing"), nullptr);
}

TEST_F(CheckSmallSequence, LossesAreCountedAndSurvived) {
  testing::WriteSequence(folder_, {.images = 40});
  const std::string list = folder_.Path("mav0/cam1/data.csv");
  std::string rows = testing::ReadText(list);
  for (const int index : {10, 11, 12}) {
    const size_t at = rows.find(std::to_string(testing::ImageStamp(index)));
    rows.erase(at, rows.find('\n', at) + 1 - at);
  }
  folder_.Write("mav0/cam1/data.csv", rows);
  std::filesystem::remove(
      folder_.Path(fmt::format("mav0/cam0/data/{}.png", testing::ImageStamp(20))));
  const CheckReport report = CheckSequence(folder_.Path());
  ExpectFinding(report, "unpaired", Severity::kWarning, "trigger");
  ExpectFinding(report, "image-gaps", Severity::kWarning, "without loss");
  ExpectFinding(report, "images-missing", Severity::kWarning, "copy");
  EXPECT_THAT(CheckJson(report), HasSubstr("\"name\": \"unpaired\""));
}

TEST_F(CheckSmallSequence, EveryImagesHeaderAndLengthIsLookedAt) {
  testing::WriteSequence(folder_, {.images = 100});
  const auto path = [&](int camera, int index) {
    return folder_.Path(fmt::format("mav0/cam{}/data/{}.png", camera, testing::ImageStamp(index)));
  };
  // None of these is among the images whose pixels are looked at.
  WriteImage(0, 1, testing::Texture(1, 0, {92, 64}));
  std::filesystem::resize_file(path(1, 2), 300);
  folder_.Write(fmt::format("mav0/cam0/data/{}.png", testing::ImageStamp(3)), "no image at all, ");
  std::filesystem::remove(path(1, 5));
  std::filesystem::create_directory(path(1, 5));
  std::filesystem::remove(path(1, 6));
  std::filesystem::create_symlink(path(1, 6), path(1, 6));
  const std::string table = CheckTable(CheckSequence(folder_.Path()));
  EXPECT_THAT(table,
              HasSubstr("images of wrong size: 1 of 100 images of cam0, first " + path(0, 1)));
  EXPECT_THAT(table, HasSubstr("images truncated: 1 of 100 images of cam1, first " + path(1, 2)));
  EXPECT_THAT(table, HasSubstr("images undecodable: 1 of 100 images of cam0, first " + path(0, 3)));
  EXPECT_THAT(table, HasSubstr("images missing: 2 of 100 images of cam1, first " + path(1, 5)));
}

TEST_F(CheckSmallSequence, TheHeaderOfAJpegSaysItsSize) {
  const std::string path = folder_.Path("a.jpg");
  cv::imwrite(path, testing::Texture(1, 0));
  EXPECT_EQ(FindImageProblem(path, {96, 64}), nullptr);
  EXPECT_STREQ(FindImageProblem(path, {64, 96}), kImageWrongSize);
  std::filesystem::resize_file(path, std::filesystem::file_size(path) - 2);
  EXPECT_STREQ(FindImageProblem(path, {96, 64}), kImageTruncated);
}

TEST_F(CheckSmallSequence, ShuffledRowsAreAWarningThatSaysSo) {
  testing::WriteSequence(folder_, {.images = 12});
  std::string rows;
  for (int i = 0; i < 12; ++i)
    rows += fmt::format("{0},{0}.png\n", testing::ImageStamp(i * 5 % 12));
  folder_.Write("mav0/cam0/data.csv", rows);
  const CheckReport report = CheckSequence(folder_.Path());
  ExpectFinding(report, "stamps", Severity::kWarning, "sorted on reading");
  EXPECT_THAT(Find(report, "stamps")->found, HasSubstr("cam0/data.csv: row "));
  EXPECT_EQ(Find(report, "unpaired"), nullptr);
}

TEST_F(CheckSmallSequence, StampsInSecondsAreNamedWithARemedy) {
  testing::WriteSequence(folder_, {.images = 12});
  std::string rows;
  for (int i = 0; i < 12; ++i) rows += fmt::format("1403636580.{:02},a.png\n", 5 * i);
  folder_.Write("mav0/cam1/data.csv", rows);
  const CheckReport report = CheckSequence(folder_.Path());
  ExpectFinding(report, "stamp-units", Severity::kError, "cam1/data.csv by 1e+09");
  EXPECT_THAT(Find(report, "stamp-units")->found, HasSubstr("in seconds"));
}

TEST_F(CheckSmallSequence, ACalibrationFaultHasItsOwnRemedy) {
  testing::WriteSequence(folder_, {.images = 2});
  std::string yaml = testing::SensorYaml(-0.1);
  yaml.replace(yaml.find("[96, 64]"), 8, "[96.5, 64]");
  folder_.Write("mav0/cam1/sensor.yaml", yaml);
  const CheckReport report = CheckSequence(folder_.Path());
  EXPECT_FALSE(report.Usable());
  ExpectFinding(report, "calibration", Severity::kError, "resolution in ");
  EXPECT_THAT(Find(report, "calibration")->remedy, HasSubstr("mav0/cam1/sensor.yaml"));
}

TEST_F(CheckSmallSequence, NamesThatAreNoUtf8DoNotBreakTheJson) {
  testing::WriteSequence(folder_, {.images = 4});
  folder_.Write("mav0/cam0/data.csv", fmt::format("{},\xff\xfe.png\n", testing::ImageStamp(1)));
  const CheckReport report = CheckSequence(folder_.Path());
  EXPECT_THAT(CheckJson(report), HasSubstr("images missing"));
}

TEST_F(CheckSmallSequence, WhatIsLeftMustBeARecording) {
  testing::WriteSequence(folder_, {.images = 12});
  EXPECT_EQ(Find(CheckSequence(folder_.Path()), "too-short"), nullptr);
  const std::string images = testing::ReadText(folder_.Path("mav0/cam1/data.csv"));
  folder_.Write("mav0/cam1/data.csv", images.substr(0, images.size() / 2));
  const CheckReport report = CheckSequence(folder_.Path());
  EXPECT_FALSE(report.Usable());
  ExpectFinding(report, "too-short", Severity::kError, "ten seconds");
  EXPECT_THAT(Find(report, "too-short")->found,
              HasSubstr("pairs and 125 IMU samples are left, expected at least 10 and 30 (images "
                        "unpaired: "));
}

TEST_F(CheckSmallSequence, StampsThatLostTheirDigitsAreNamed) {
  testing::WriteSequence(folder_, {.images = 12});
  for (const char* name : {"mav0/cam0/data.csv", "mav0/cam1/data.csv", "mav0/imu0/data.csv"}) {
    std::string text = testing::ReadText(folder_.Path(name));
    for (size_t row = text.find("\n14"); row != std::string::npos;
         row = text.find("\n14", row + 1)) {
      text.replace(row + 1, 19, "1.40364E+18");
    }
    folder_.Write(name, text);
  }
  ExpectFinding(CheckSequence(folder_.Path()), "stamp-digits", Severity::kError,
                "mav0/cam0/data.csv with all its digits, as whole numbers");
}

TEST_F(CheckSmallSequence, CanBeEnded) {
  testing::WriteSequence(folder_, {.images = 4});
  EXPECT_THROW(CheckSequence(folder_.Path(), {}, Progress([](double) { return false; })),
               StoppedError);
}

class CheckRealRecording : public ::testing::Test {
 protected:
  void SetUp() override {
    path_ = testing::SharedData("euroc_mh01_8s");
    if (path_.empty()) GTEST_SKIP() << "no real recording here";
    sequence_ = OpenSequence(path_);
  }
  std::string path_;
  Sequence sequence_;
};

TEST_F(CheckRealRecording, IsUsable) {
  const CheckReport report = CheckSequence(path_);
  EXPECT_TRUE(report.Usable()) << CheckTable(report);
  EXPECT_TRUE(report.findings.empty()) << CheckTable(report);
}

CheckReport StartCheckOf(const Sequence& sequence) {
  AslSource source(sequence);
  return CheckStart(&source, sequence.imu);
}

TEST_F(CheckRealRecording, SwappedImagesAreNoticed) {
  for (StereoEntry& pair : sequence_.images) std::swap(pair.left_path, pair.right_path);
  CheckReport report;
  CheckGeometry(AslSource(sequence_), sequence_.imu, {}, &report);
  ExpectFinding(report, "left-right", Severity::kError, "swap the images");
}

TEST_F(CheckRealRecording, InvertedTransformsAreNoticed) {
  for (RigidTransform& T : sequence_.rig.T_imu_camera) T = T.Inverse();
  CheckReport report;
  CheckGeometry(AslSource(sequence_), sequence_.imu, {}, &report);
  ExpectFinding(report, "extrinsics-direction", Severity::kError, "invert");
}

TEST_F(CheckRealRecording, ALateCameraIsCorrectedBeforeTheStart) {
  for (StereoEntry& pair : sequence_.images) pair.stamp_ns += 40'000'000;
  const CheckReport report = StartCheckOf(sequence_);
  ExpectFinding(report, "time-offset", Severity::kWarning, "timeshift_cam_imu: -0.0");
  EXPECT_TRUE(report.Usable());
  EXPECT_NEAR(Corrected(sequence_.rig, report).camera_time_offset_s, -0.040, 1e-3);
}

TEST_F(CheckRealRecording, ClocksThatAreSecondsApartAreNamed) {
  for (StereoEntry& pair : sequence_.images) pair.stamp_ns += 3'000'000'000;
  const CheckReport report = StartCheckOf(sequence_);
  ExpectFinding(report, "time-offset", Severity::kError, "add -3.00");
  EXPECT_TRUE(report.corrections.empty());
}

TEST_F(CheckRealRecording, AClockSetForwardIsToldFromAGap) {
  const auto middle = std::next(sequence_.images.begin(), std::ssize(sequence_.images) / 2);
  const int64_t from_ns = middle->stamp_ns;
  const auto with = [&](bool images, bool imu, int64_t by_ns) {
    Sequence sequence = sequence_;
    for (StereoEntry& pair : sequence.images) {
      pair.stamp_ns += images && pair.stamp_ns >= from_ns ? by_ns : 0;
    }
    for (ImuSample& sample : sequence.imu) {
      sample.stamp_ns += imu && sample.stamp_ns >= from_ns ? by_ns : 0;
    }
    return StartCheckOf(sequence);
  };
  for (const int64_t by_ns : {400'000'000LL, 150'000'000LL}) {
    const CheckReport of_imu = with(false, true, by_ns), of_images = with(true, false, by_ns);
    const std::string by = fmt::format("take {} from the stamps of ", by_ns);
    ExpectFinding(of_imu, "clock", Severity::kError, by + "imu0/data.csv");
    ExpectFinding(of_images, "clock", Severity::kError, by + "cam0/data.csv and cam1/data.csv");
  }
  EXPECT_EQ(Find(with(true, true, 400'000'000), "clock"), nullptr);
  Sequence lost = sequence_;
  std::erase_if(lost.images, [&](const StereoEntry& pair) {
    return pair.stamp_ns >= from_ns && pair.stamp_ns < from_ns + 400'000'000;
  });
  EXPECT_EQ(Find(StartCheckOf(lost), "clock"), nullptr);
  lost = sequence_;
  std::erase_if(lost.imu, [&](const ImuSample& sample) {
    return sample.stamp_ns >= from_ns && sample.stamp_ns < from_ns + 120'000'000;
  });
  EXPECT_EQ(Find(StartCheckOf(lost), "clock"), nullptr);
}

TEST_F(CheckRealRecording, ATimeOffsetThatIsHardlyKnownIsLeftAloneAndNoted) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 0.4);
  for (ImuSample& sample : sequence_.imu) {
    sample.angular_velocity_rad_s += Eigen::Vector3d(noise(random), noise(random), noise(random));
  }
  CheckReport report;
  CheckMotion(AslSource(sequence_), sequence_.rig, sequence_.imu, {}, &report);
  ExpectFinding(report, "time-offset", Severity::kNote, "turn the rig");
  EXPECT_TRUE(report.corrections.empty());
}

TEST_F(CheckRealRecording, WhatAShortMotionDoesNotTellIsNoted) {
  sequence_.images.resize(40);
  CheckReport report;
  CheckMotion(AslSource(sequence_), sequence_.rig, sequence_.imu, {}, &report);
  ExpectFinding(report, "accelerations", Severity::kNote, "move the rig");
  EXPECT_THAT(Find(report, "accelerations")->found, HasSubstr("baseline"));
}

TEST_F(CheckRealRecording, RightImagesThatAreOneLateAreNamed) {
  for (size_t i = sequence_.images.size() - 1; i > 0; --i) {
    sequence_.images[i].right_path = sequence_.images[i - 1].right_path;
  }
  CheckReport report;
  CheckStereo(AslSource(sequence_), {}, &report);
  ExpectFinding(report, "synchronisation", Severity::kError, "images of cam1 are 1 late");
}

TEST_F(CheckRealRecording, ATurnedRightCameraIsCorrectedBeforeTheStart) {
  const Eigen::Quaterniond right = sequence_.rig.T_imu_camera[1].rotation;
  sequence_.rig.T_imu_camera[1].rotation = right * ExpRotation({0.004, 0, 0.004});
  CheckReport report;
  CheckStereo(AslSource(sequence_), {}, &report);
  ExpectFinding(report, "rectification", Severity::kWarning, "calibrate");
  const Rig corrected = Corrected(sequence_.rig, report);
  EXPECT_LT(corrected.T_imu_camera[1].rotation.angularDistance(right), 5e-4);
}

TEST_F(CheckRealRecording, ANegatedAxisOfTheGyroscopeIsNamed) {
  for (ImuSample& sample : sequence_.imu) sample.angular_velocity_rad_s.y() *= -1;
  CheckReport report;
  CheckMotion(AslSource(sequence_), sequence_.rig, sequence_.imu, {}, &report);
  ExpectFinding(report, "gyro-axes", Severity::kError, "y negated");
}

TEST_F(CheckRealRecording, SwappedAxesOfTheAccelerometerAreNamed) {
  for (ImuSample& sample : sequence_.imu) {
    std::swap(sample.specific_force_m_s2.x(), sample.specific_force_m_s2.z());
  }
  CheckReport report;
  CheckMotion(AslSource(sequence_), sequence_.rig, sequence_.imu, {}, &report);
  ExpectFinding(report, "accel-axes", Severity::kError, "x and z swapped");
}

TEST_F(CheckRealRecording, ATurnedImuIsNamed) {
  const Eigen::Quaterniond half_turn(0, 1, 0, 0);
  for (RigidTransform& T : sequence_.rig.T_imu_camera) T = RigidTransform(half_turn, {}) * T;
  CheckReport report;
  CheckMotion(AslSource(sequence_), sequence_.rig, sequence_.imu, {}, &report);
  ExpectFinding(report, "imu-camera", Severity::kError, "[0.01");
  EXPECT_THAT(Find(report, "imu-camera")->found, HasSubstr("y and z negated"));
}

// A Kalibr chain of a rig with the IMU's axes mirrored: those of T_cam_imu's columns.
std::string MirroredChain(const std::string& folder, const Rig& rig,
                          const Eigen::Matrix3d& mirror) {
  const std::string path = folder + "/chain.yaml";
  std::string text;
  for (int i = 0; i < 2; ++i) {
    Eigen::Matrix4d T = rig.T_imu_camera[i].Inverse().Matrix();
    T.topLeftCorner<3, 3>() *= mirror;
    const Camera& c = rig.cameras[i];
    std::ostringstream rows;
    const Eigen::IOFormat list(17, Eigen::DontAlignCols, ", ", ", ", "[", "]", "[", "]");
    rows << T.format(list);
    text += fmt::format(
        "cam{}:\n  T_cam_imu: {}\n  camera_model: pinhole\n  distortion_coeffs: [{}, {}, {}, {}]\n"
        "  distortion_model: radtan\n  intrinsics: [{}, {}, {}, {}]\n  resolution: [{}, {}]\n",
        i, rows.str(), c.coefficients[0], c.coefficients[1], c.coefficients[2], c.coefficients[3],
        c.fx_px, c.fy_px, c.cx_px, c.cy_px, c.width_px, c.height_px);
  }
  WriteFile(path, text);
  return path;
}

TEST_F(CheckRealRecording, MirroredAxesOfTheImuAreNamed) {
  const testing::TempFolder folder;
  Eigen::Matrix3d swapped;
  swapped << 0, 1, 0, 1, 0, 0, 0, 0, 1;
  const Eigen::Matrix3d negated = Eigen::Vector3d(1, 1, -1).asDiagonal();
  for (const auto& [mirror, words] :
       {std::pair(swapped, "x and y swapped"), std::pair(negated, "z negated")}) {
    SequenceOptions options;
    options.calibration = MirroredChain(folder.Path(), sequence_.rig, mirror);
    const CheckReport report = CheckSequence(path_, options);
    ExpectFinding(report, "calibration", Severity::kError, words);
    EXPECT_THAT(Find(report, "calibration")->found, HasSubstr("determinant -1"));
    EXPECT_THROW(OpenSequence(path_, options), MirroredFault);
  }
}

TEST_F(CheckRealRecording, ABaselineOfHalfItsLengthIsNamed) {
  auto& poses = sequence_.rig.T_imu_camera;
  poses[1].translation = 0.5 * (poses[0].translation + poses[1].translation);
  CheckReport report;
  CheckMotion(AslSource(sequence_), sequence_.rig, sequence_.imu, {}, &report);
  ExpectFinding(report, "baseline", Severity::kError, "0.1");
}

TEST_F(CheckRealRecording, ABaselineThatIsTooLongByASeventhIsDoubtful) {
  auto& poses = sequence_.rig.T_imu_camera;
  poses[1].translation += 0.15 * (poses[1].translation - poses[0].translation);
  CheckReport report;
  CheckMotion(AslSource(sequence_), sequence_.rig, sequence_.imu, {}, &report);
  ExpectFinding(report, "baseline", Severity::kWarning, "about 0.109 m");
}

TEST_F(CheckRealRecording, DegreesAreNoticed) {
  for (ImuSample& sample : sequence_.imu) {
    sample.angular_velocity_rad_s *= 180 / std::numbers::pi;
  }
  CheckReport report;
  CheckImu(sequence_.imu, &report);
  ExpectFinding(report, "imu-units", Severity::kError, "deg/s");
}

TEST(CheckReport, RemediesNameTheCamerasThatWereChosen) {
  CheckReport report;
  report.cameras = {"cam1", "cam0"};
  report.Warn("a", "found", "swap cam0 and cam1, T_cam_imu stays");
  EXPECT_EQ(report.findings[0].remedy, "swap cam1 and cam0, T_cam_imu stays");
}

}  // namespace
}  // namespace slcmap
