#include "data/check/check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <functional>
#include <numbers>
#include <random>

#include "data/calibration/calibration.h"
#include "data/core/error.h"
#include "data/io/image.h"
#include "data/source/recorded_source.h"
#include "tests/testing/pinhole_camera.h"
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
  report.cameras = {"cam1", "cam0"};
  report.Warn("a", "found", "swap cam0 and cam1, T_cam_imu stays");
  EXPECT_EQ(report.findings[0].remedy, "swap cam1 and cam0, T_cam_imu stays");
}

void ExpectFinding(const CheckReport& report, const std::string& name, Severity severity,
                   const std::string& remedy, const std::string& found = "") {
  const CheckFinding* finding = Find(report, name);
  ASSERT_NE(finding, nullptr) << name << "\n" << CheckTable(report);
  EXPECT_EQ(finding->severity, severity) << CheckTable(report);
  EXPECT_THAT(finding->remedy, HasSubstr(remedy));
  EXPECT_THAT(finding->found, HasSubstr(found));
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

CheckReport CheckOf(const std::vector<ImuSample>& samples) {
  CheckReport report;
  CheckImu(samples, &report);
  return report;
}

TEST(CheckImu, TellsUnitsApart) {
  EXPECT_TRUE(CheckOf(TurningImu(1, 1)).findings.empty());
  ExpectFinding(CheckOf(TurningImu(1, 1 / 9.81)), "imu-units", Severity::kError, "9.80665");
  ExpectFinding(CheckOf(TurningImu(180 / std::numbers::pi, 1)), "imu-units", Severity::kError,
                "deg/s");
  ExpectFinding(CheckOf(TurningImu(1, 0.01)), "imu-gravity", Severity::kError, "raw accelerometer");
}

TEST(CheckImu, NamesDeadAxesSwappedColumnsAndAbsurdValues) {
  const std::vector<ImuSample> good = TurningImu(1, 1);
  std::vector<ImuSample> dead = good, swapped = good, absurd = good;
  for (size_t i = 0; i < good.size(); ++i) {
    dead[i].angular_velocity_rad_s.z() = 0;
    if (i >= 300) dead[i].specific_force_m_s2.x() = 0.5;
    std::swap(swapped[i].angular_velocity_rad_s, swapped[i].specific_force_m_s2);
  }
  ExpectFinding(CheckOf(dead), "gyro-dead", Severity::kError, "gyroscope",
                "z is 0 for 3.0 s, while");
  ExpectFinding(CheckOf(dead), "accel-dead", Severity::kError, "accelerometer",
                "x is 0.5 for 1.5 s");
  ExpectFinding(CheckOf(swapped), "imu-columns", Severity::kError, "swapped");
  absurd[100].specific_force_m_s2.x() = 1e6;
  absurd[200].angular_velocity_rad_s.z() = -500;
  ExpectFinding(CheckOf(absurd), "imu-values", Severity::kWarning, "driver", "2 of 600 samples");
  for (ImuSample& sample : absurd) sample.angular_velocity_rad_s *= 1e4;
  ExpectFinding(CheckOf(absurd), "imu-values", Severity::kError, "units");
}

Rig SideBySide() {
  Rig rig;
  rig.cameras.assign(2, testing::PinholeCamera(640, 480, 400, 320, 240));
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
  void Write(int images) { testing::WriteSequence(folder_, {.images = images}); }
  std::string ImagePath(int camera, int index) const {
    return folder_.Path(fmt::format("mav0/cam{}/data/{}.png", camera, testing::ImageStamp(index)));
  }
  void WriteImage(int camera, int index, const cv::Mat& image) {
    cv::imwrite(ImagePath(camera, index), image);
  }
  CheckReport Check() const { return CheckSequence(folder_.Path()); }
  TempFolder folder_;
};

TEST_F(CheckSmallSequence, AFolderThatIsNoSequenceIsOneFinding) {
  EXPECT_FALSE(Check().Usable());
  ExpectFinding(Check(), "unreadable", Severity::kError, "mav0/cam0");
}

TEST_F(CheckSmallSequence, ACameraThatHangsIsNamedWithItsTime) {
  testing::WriteSequence(folder_, {.images = 12, .still = true});
  ExpectFinding(Check(), "frozen-camera", Severity::kError, "hangs");
  std::filesystem::remove_all(folder_.Path("mav0"));
  Write(40);
  for (int i = 21; i < 27; ++i) WriteImage(1, i, testing::Texture(20, 4));
  ExpectFinding(Check(), "frozen-camera", Severity::kWarning, "hangs",
                fmt::format("6 of 40 images of cam1 repeat the one before, the longest time 0.30 s "
                            "from stamp {}",
                            testing::ImageStamp(20)));
}

TEST_F(CheckSmallSequence, ASecondCameraIsNotNeeded) {
  Write(12);
  std::filesystem::remove_all(folder_.Path("mav0/cam1"));
  const CheckReport report = Check();
  for (const char* name : {"unreadable", "images-missing", "same-images"}) {
    EXPECT_EQ(Find(report, name), nullptr) << CheckTable(report);
  }
  EXPECT_NE(Find(report, "one-camera"), nullptr) << CheckTable(report);
}

TEST_F(CheckSmallSequence, ABlackCameraAndOneOfAnotherSizeAreNamed) {
  Write(12);
  for (int i = 0; i < 12; ++i) WriteImage(1, i, cv::Mat::zeros(64, 96, CV_8U));
  ExpectFinding(Check(), "black-camera", Severity::kError, "lens", "cam1");
  for (int i = 0; i < 12; ++i) {
    for (const int camera : {0, 1}) WriteImage(camera, i, testing::Texture(i, 0, {128, 96}));
  }
  ExpectFinding(Check(), "images", Severity::kError, "calibrate");
}

TEST_F(CheckSmallSequence, ExposureThatSwingsIsNamedFromWhenOn) {
  Write(60);
  EXPECT_EQ(Find(Check(), "exposure"), nullptr);
  std::string rows;
  for (int i = 0; i < 60; ++i) {
    if (i >= 30 && i % 2 == 0) WriteImage(1, i, 0.5 * testing::Texture(i, 4));
    rows += fmt::format("{},{}.png\n", testing::kFirstStamp_ns + i * 1'000'000'000LL,
                        testing::ImageStamp(i));
  }
  const CheckReport report = Check();
  for (const char* found :
       {"of cam1 swings by up to 2", "16 of 30 sampled places, from about 1.4 s on"}) {
    ExpectFinding(report, "exposure", Severity::kWarning, "hold exposure", found);
  }
  // Images of other places, a second apart, do not tell of exposure.
  for (const int camera : {0, 1}) {
    folder_.Write(fmt::format("mav0/cam{}/data.csv", camera), rows);
  }
  EXPECT_EQ(Find(Check(), "exposure"), nullptr);
}

TEST_F(CheckSmallSequence, WhatLeavesNoPairsIsAnError) {
  Write(40);
  // Of no camera more than half.
  for (int i = 0; i < 30; ++i) std::filesystem::remove(ImagePath(i % 2, i));
  ExpectFinding(Check(), "images-unusable", Severity::kError, "mend", "30 of 40 pairs");
  for (int i = 0; i < 40; ++i) {
    WriteImage(0, i, testing::Texture(i, 0));
    std::filesystem::remove(ImagePath(1, i));
  }
  ExpectFinding(Check(), "images-missing", Severity::kError, "copy", "40 of 40 images of cam1");
  Sequence sequence = OpenSequence(folder_.Path());
  RecordedSource source(sequence);
  ExpectFinding(CheckStart(&source, sequence.imu), "images-missing", Severity::kError, "copy");
  sequence.rig.cameras[1] = Camera();  // as odometry of one camera has it
  RecordedSource left(sequence);
  EXPECT_EQ(Find(CheckStart(&left, sequence.imu), "images-missing"), nullptr);
}

TEST_F(CheckSmallSequence, LossesAreCountedAndSurvived) {
  Write(40);
  const std::string list = folder_.Path("mav0/cam1/data.csv");
  std::string rows = testing::ReadText(list);
  for (const int index : {10, 11, 12}) {
    const size_t at = rows.find(std::to_string(testing::ImageStamp(index)));
    rows.erase(at, rows.find('\n', at) + 1 - at);
  }
  folder_.Write("mav0/cam1/data.csv", rows);
  std::filesystem::remove(ImagePath(0, 20));
  const CheckReport report = Check();
  ExpectFinding(report, "unpaired", Severity::kWarning, "trigger");
  ExpectFinding(report, "image-gaps", Severity::kWarning, "without loss");
  ExpectFinding(report, "images-missing", Severity::kWarning, "copy");
  EXPECT_THAT(CheckJson(report), HasSubstr("\"name\": \"unpaired\""));
}

TEST_F(CheckSmallSequence, EveryImagesHeaderAndLengthIsLookedAt) {
  Write(100);
  // None of these is among the images whose pixels are looked at.
  WriteImage(0, 1, testing::Texture(1, 0, {92, 64}));
  std::filesystem::resize_file(ImagePath(1, 2), 300);
  folder_.Write(fmt::format("mav0/cam0/data/{}.png", testing::ImageStamp(3)), "no image at all, ");
  std::filesystem::remove(ImagePath(1, 5));
  std::filesystem::create_directory(ImagePath(1, 5));
  std::filesystem::remove(ImagePath(1, 6));
  std::filesystem::create_symlink(ImagePath(1, 6), ImagePath(1, 6));
  const std::string table = CheckTable(Check());
  for (const std::string& part :
       {"images of wrong size: 1 of 100 images of cam0, first " + ImagePath(0, 1),
        "images truncated: 1 of 100 images of cam1, first " + ImagePath(1, 2),
        "images undecodable: 1 of 100 images of cam0, first " + ImagePath(0, 3),
        "images missing: 2 of 100 images of cam1, first " + ImagePath(1, 5)}) {
    EXPECT_THAT(table, HasSubstr(part));
  }
}

TEST_F(CheckSmallSequence, TablesWhoseStampsAreWrongAreNamedWithARemedy) {
  Write(12);
  std::string shuffled, in_seconds;
  for (int i = 0; i < 12; ++i) {
    shuffled += fmt::format("{0},{0}.png\n", testing::ImageStamp(i * 5 % 12));
    in_seconds += fmt::format("1403636580.{:02},a.png\n", 5 * i);
  }
  folder_.Write("mav0/cam0/data.csv", shuffled);
  ExpectFinding(Check(), "stamps", Severity::kWarning, "sorted on reading", "cam0/data.csv: row ");
  EXPECT_EQ(Find(Check(), "unpaired"), nullptr);
  folder_.Write("mav0/cam1/data.csv", in_seconds);
  ExpectFinding(Check(), "stamp-units", Severity::kError, "cam1/data.csv by 1e+09", "in seconds");
}

TEST_F(CheckSmallSequence, ACalibrationFaultHasItsOwnRemedy) {
  Write(2);
  std::string yaml = testing::SensorYaml(-0.1);
  yaml.replace(yaml.find("[96, 64]"), 8, "[96.5, 64]");
  folder_.Write("mav0/cam1/sensor.yaml", yaml);
  ExpectFinding(Check(), "calibration", Severity::kError, "mav0/cam1/sensor.yaml");
}

TEST_F(CheckSmallSequence, NamesThatAreNoUtf8DoNotBreakTheJson) {
  Write(4);
  folder_.Write("mav0/cam0/data.csv", fmt::format("{},\xff\xfe.png\n", testing::ImageStamp(1)));
  EXPECT_THAT(CheckJson(Check()), HasSubstr("images missing"));
}

TEST_F(CheckSmallSequence, WhatIsLeftMustBeARecording) {
  Write(12);
  EXPECT_EQ(Find(Check(), "too-short"), nullptr);
  const std::string images = testing::ReadText(folder_.Path("mav0/cam1/data.csv"));
  folder_.Write("mav0/cam1/data.csv", images.substr(0, images.size() / 2));
  EXPECT_FALSE(Check().Usable());
  ExpectFinding(Check(), "too-short", Severity::kError, "ten seconds",
                "pairs and 125 IMU samples are left, expected at least 10 and 30 (images "
                "unpaired: ");
}

TEST_F(CheckSmallSequence, CanBeEnded) {
  Write(4);
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
  // What a part of the check adds to a report.
  template <typename Part>
  CheckReport ReportOf(Part check) const {
    CheckReport report;
    check(RecordedSource(sequence_), &report);
    return report;
  }
  CheckReport CheckedGeometry() const {
    return ReportOf([&](const RecordedSource& source, CheckReport* report) {
      CheckGeometry(source, sequence_.imu, {}, report);
    });
  }
  CheckReport CheckedMotion() const {
    return ReportOf([&](const RecordedSource& source, CheckReport* report) {
      CheckMotion(source, sequence_.rig, sequence_.imu, {}, report);
    });
  }
  CheckReport CheckedStereo() const {
    return ReportOf(
        [](const RecordedSource& source, CheckReport* report) { CheckStereo(source, {}, report); });
  }
  CheckReport CheckedClock() const {
    return ReportOf([&](const RecordedSource& source, CheckReport* report) {
      CheckClock(source, sequence_.rig, sequence_.imu, {}, report);
    });
  }
  CheckReport StartCheck() const {
    RecordedSource source(sequence_);
    return CheckStart(&source, sequence_.imu);
  }
  void Delay(int64_t by_ns) {
    for (StereoEntry& pair : sequence_.images) pair.stamp_ns += by_ns;
  }
  std::string path_;
  Sequence sequence_;
};

TEST_F(CheckRealRecording, IsUsable) {
  const CheckReport report = CheckSequence(path_);
  EXPECT_TRUE(report.Usable()) << CheckTable(report);
  EXPECT_TRUE(report.findings.empty()) << CheckTable(report);
}

TEST_F(CheckRealRecording, SwappedImagesAndInvertedTransformsAreNoticed) {
  const Sequence good = sequence_;
  for (StereoEntry& pair : sequence_.images) std::swap(pair.left_path, pair.right_path);
  ExpectFinding(CheckedGeometry(), "left-right", Severity::kError, "swap the images");
  sequence_ = good;
  for (RigidTransform& T : sequence_.rig.T_imu_camera) T = T.Inverse();
  ExpectFinding(CheckedGeometry(), "extrinsics-direction", Severity::kError, "invert");
}

TEST_F(CheckRealRecording, ALateCameraIsCorrectedBeforeTheStart) {
  Delay(40'000'000);
  const CheckReport report = StartCheck();
  ExpectFinding(report, "time-offset", Severity::kWarning, "timeshift_cam_imu: -0.0");
  EXPECT_TRUE(report.Usable());
  EXPECT_NEAR(Corrected(sequence_.rig, report).camera_time_offset_s, -0.040, 1e-3);
}

TEST_F(CheckRealRecording, ClocksThatAreSecondsApartAreNamed) {
  Delay(3'000'000'000);
  const CheckReport report = CheckedMotion();
  ExpectFinding(report, "time-offset", Severity::kError, "add -3.00");
  EXPECT_TRUE(report.corrections.empty());
}

TEST_F(CheckRealRecording, AClockSetForwardIsToldFromAGap) {
  const Sequence good = sequence_;
  const int64_t from_ns = good.images[good.images.size() / 2].stamp_ns;
  const auto set_forward = [&](bool images, bool imu, int64_t by_ns) {
    sequence_ = good;
    for (StereoEntry& pair : sequence_.images) {
      pair.stamp_ns += images && pair.stamp_ns >= from_ns ? by_ns : 0;
    }
    for (ImuSample& sample : sequence_.imu) {
      sample.stamp_ns += imu && sample.stamp_ns >= from_ns ? by_ns : 0;
    }
  };
  set_forward(false, true, 400'000'000);
  ExpectFinding(CheckedGeometry(), "clock", Severity::kError,
                "take 400000000 from the stamps of imu0/data.csv");
  set_forward(true, false, 150'000'000);
  ExpectFinding(CheckedClock(), "clock", Severity::kError,
                "take 150000000 from the stamps of cam0/data.csv and cam1/data.csv");
  set_forward(true, true, 400'000'000);
  EXPECT_EQ(Find(CheckedClock(), "clock"), nullptr);
  sequence_ = good;
  std::erase_if(sequence_.images, [&](const StereoEntry& pair) {
    return pair.stamp_ns >= from_ns && pair.stamp_ns < from_ns + 400'000'000;
  });
  EXPECT_EQ(Find(CheckedClock(), "clock"), nullptr);
  sequence_ = good;
  std::erase_if(sequence_.imu, [&](const ImuSample& sample) {
    return sample.stamp_ns >= from_ns && sample.stamp_ns < from_ns + 120'000'000;
  });
  EXPECT_EQ(Find(CheckedClock(), "clock"), nullptr);
}

TEST_F(CheckRealRecording, ATimeOffsetThatIsHardlyKnownIsLeftAloneAndNoted) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 0.4);
  for (ImuSample& sample : sequence_.imu) {
    sample.angular_velocity_rad_s += Eigen::Vector3d(noise(random), noise(random), noise(random));
  }
  const CheckReport report = CheckedMotion();
  ExpectFinding(report, "time-offset", Severity::kNote, "turn the rig");
  EXPECT_TRUE(report.corrections.empty());
}

TEST_F(CheckRealRecording, WhatAShortMotionDoesNotTellIsNoted) {
  sequence_.images.resize(40);
  ExpectFinding(CheckedMotion(), "accelerations", Severity::kNote, "move the rig", "baseline");
}

TEST_F(CheckRealRecording, RightImagesThatAreOneLateAreNamed) {
  for (size_t i = sequence_.images.size() - 1; i > 0; --i) {
    sequence_.images[i].right_path = sequence_.images[i - 1].right_path;
  }
  ExpectFinding(CheckedStereo(), "synchronisation", Severity::kError, "images of cam1 are 1 late");
}

TEST_F(CheckRealRecording, ATurnedRightCameraIsCorrectedBeforeTheStart) {
  const Eigen::Quaterniond right = sequence_.rig.T_imu_camera[1].rotation;
  sequence_.rig.T_imu_camera[1].rotation = right * ExpRotation({0.004, 0, 0.004});
  const CheckReport report = CheckedStereo();
  ExpectFinding(report, "rectification", Severity::kWarning, "calibrate");
  const Rig corrected = Corrected(sequence_.rig, report);
  EXPECT_LT(corrected.T_imu_camera[1].rotation.angularDistance(right), 5e-4);
}

// Each is made of the good recording.
TEST_F(CheckRealRecording, WrongAxesAndBaselinesAreNamed) {
  const RigidTransform half_turn(Eigen::Quaterniond(0, 1, 0, 0), Eigen::Vector3d::Zero());
  struct Fault {
    std::function<void(Sequence*)> make;
    std::string name, remedy, found;
    Severity severity = Severity::kError;
  };
  const auto of_samples = [](auto change) {
    return [change](Sequence* sequence) { std::ranges::for_each(sequence->imu, change); };
  };
  const auto longer = [](double share) {
    return [share](Sequence* sequence) {
      auto& poses = sequence->rig.T_imu_camera;
      poses[1].translation += share * (poses[1].translation - poses[0].translation);
    };
  };
  const Fault kFaults[] = {
      {of_samples([](ImuSample& sample) { sample.angular_velocity_rad_s.y() *= -1; }), "gyro-axes",
       "y negated", ""},
      {of_samples([](ImuSample& sample) {
         std::swap(sample.specific_force_m_s2.x(), sample.specific_force_m_s2.z());
       }),
       "accel-axes", "x and z swapped", ""},
      {[&](Sequence* sequence) {
         for (RigidTransform& T : sequence->rig.T_imu_camera) T = half_turn * T;
       },
       "imu-camera", "[0.01", "y and z negated"},
      {longer(-0.5), "baseline", "0.1", ""},
      {longer(0.15), "baseline", "about 0.109 m", "", Severity::kWarning}};
  const Sequence good = sequence_;
  for (const Fault& fault : kFaults) {
    SCOPED_TRACE(fault.name + ": " + fault.remedy);
    sequence_ = good;
    fault.make(&sequence_);
    ExpectFinding(CheckedMotion(), fault.name, fault.severity, fault.remedy, fault.found);
  }
}

// The rows of the cameras' poses are the IMU's axes.
TEST_F(CheckRealRecording, MirroredAxesOfTheImuAreNamed) {
  const TempFolder folder;
  for (const std::string sensor : {"cam0", "cam1", "imu0"}) {
    std::string text = testing::ReadText(path_ + "/mav0/" + sensor + "/sensor.yaml");
    if (sensor != "imu0") {
      const size_t x = text.find("data: [") + 7, y = text.find('\n', x), z = text.find('\n', y + 1);
      text = text.substr(0, x) + text.substr(y, z - y) + text.substr(x, y - x) + text.substr(z);
    }
    folder.Write("mav0/" + sensor + "/sensor.yaml", text);
  }
  SequenceOptions options;
  options.calibration = folder.Path("mav0");
  ExpectFinding(CheckSequence(path_, options), "calibration", Severity::kError, "x and y swapped",
                "determinant -1");
  EXPECT_THROW(OpenSequence(path_, options), MirroredFault);
}

}  // namespace
}  // namespace slcmap
