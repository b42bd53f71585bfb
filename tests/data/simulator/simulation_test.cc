#include "data/simulator/simulation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "data/calibration/calibration.h"
#include "data/calibration/imu_calibration.h"
#include "data/core/error.h"
#include "data/io/file.h"
#include "data/source/sequence.h"
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
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    options_.scene = folder_ + "/scene.yaml";
    options_.folder = folder_ + "/sequence";
    WriteFile(options_.scene,
              "trajectory: {kind: robot, waypoints_m: [[0, 0, 1], [2, 0, 1]], stand_still_s: 0.5, "
              "speed_m_s: 1.0}\n");
  }
  void TearDown() override { fs::remove_all(folder_); }

  SimulationState Run(int most_pairs = 1000) {
    return Simulate(
        options_, [](const RenderTask& task) { return std::make_unique<NumberPainter>(task); },
        [&](const SimulationState& state) { return state.pairs < most_pairs; });
  }

  const std::string folder_ = ::testing::TempDir() + "simulation_" +
                              ::testing::UnitTest::GetInstance()->current_test_info()->name();
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

TEST_F(SimulationTest, StampsAreOnTheCamerasClock) {
  Run();
  const int64_t first_ns = OpenSequence(options_.folder).images.front().stamp_ns;
  fs::remove_all(options_.folder);
  options_.time_offset_s = 0.012;
  Run();
  EXPECT_EQ(OpenSequence(options_.folder).images.front().stamp_ns, first_ns - 12'000'000);
}

TEST_F(SimulationTest, AWrongCalibrationIsToldButNotTrue) {
  options_.miscalibration = 1;
  Run();
  const std::string truth = options_.folder + "/truth/rig.yaml";
  Warnings warnings;
  const Rig rig = ReadKalibrCalibration(truth, truth, &warnings).rig;
  EXPECT_EQ(rig.cameras[0].fx_px, 458.654);
  EXPECT_GT(std::abs(OpenSequence(options_.folder).rig.cameras[0].fx_px - 458.654), 0.05);
}

TEST_F(SimulationTest, AnImuThatMisreadsIsToldInTheTruthOnly) {
  Run();
  const Sequence exact = OpenSequence(options_.folder);
  fs::remove_all(options_.folder);
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
  EXPECT_FALSE(IsIdentity(corrected.rig.imu_correction));
  ASSERT_EQ(corrected.imu.size(), exact.imu.size());
  for (size_t i = 0; i < exact.imu.size(); ++i) {
    const ImuSample &a = corrected.imu[i], &b = exact.imu[i];
    EXPECT_LT((a.specific_force_m_s2 - b.specific_force_m_s2).norm(), 1e-8);
    EXPECT_LT((a.angular_velocity_rad_s - b.angular_velocity_rad_s).norm(), 1e-8);
  }
}

TEST_F(SimulationTest, KeepsWhatIsDoneWhenItIsEndedEarly) {
  const SimulationState summary = Run(0);
  EXPECT_LT(summary.pairs, summary.planned_pairs);
  const std::string images = ReadFile(options_.folder + "/mav0/cam1/data.csv");
  EXPECT_EQ(std::count(images.begin(), images.end(), '\n'), 1 + summary.pairs);
}

TEST_F(SimulationTest, TheBytesDoNotDependOnTheThreads) {
  Run();
  const std::string imu = ReadFile(options_.folder + "/mav0/imu0/data.csv");
  const std::string image = ReadFile(OpenSequence(options_.folder).images.back().left_path);
  fs::remove_all(options_.folder);
  options_.threads = 1;
  Run();
  EXPECT_EQ(ReadFile(options_.folder + "/mav0/imu0/data.csv"), imu);
  EXPECT_EQ(ReadFile(OpenSequence(options_.folder).images.back().left_path), image);
}

TEST_F(SimulationTest, EachBuildingHasItsOwnImuBiases) {
  const std::string motion = ReadFile(options_.scene);
  const auto imu_of = [&](const std::string& name, int64_t seed) {
    WriteFile(options_.scene, "name: " + name + "\n" + motion);
    options_.seed = seed;
    fs::remove_all(options_.folder);
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
    const auto simulate = [&] {
      Simulate(
          options_, [](const RenderTask& task) { return std::make_unique<NumberPainter>(task); },
          [](const SimulationState&) { return true; }, stage);
    };
    EXPECT_THROW(simulate(), StoppedError) << ended;
    EXPECT_FALSE(fs::exists(options_.folder + "/mav0")) << ended;
    EXPECT_FALSE(fs::exists(options_.folder + "/truth")) << ended;
  }
}

TEST_F(SimulationTest, RefusesWhatNoDiskCanHold) {
  WriteFile(options_.scene,
            "trajectory: {kind: robot, waypoints_m: [[0, 0, 1], [2, 0, 1]], stand_still_s: 300}\n");
  options_.image_rate_hz = 1000;
  try {
    Run();
    FAIL() << "expected an error";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("pairs at 1000 Hz, expected at most 500000"),
              std::string::npos)
        << error.what();
  }
}

TEST_F(SimulationTest, RefusesWhatMakesNoSense) {
  options_.seed = -1;
  EXPECT_THROW(Run(), ConfigError);
  options_.seed = 1;
  options_.seed = int64_t{1} << 32;  // as 0, images would have the noise of another seed
  EXPECT_THAT(MessageOf<ConfigError>([this] { Run(); }),
              HasSubstr("--seed: found 4294967296, expected 0 to 4294967295"));
  options_.seed = 1;
  for (const double rate_hz : {0.0, 1e-300}) {
    options_.image_rate_hz = rate_hz;
    EXPECT_THAT(MessageOf<ConfigError>([this] { Run(); }),
                HasSubstr(fmt::format("--rate: found {:.6g}, expected 0.01 to 1000", rate_hz)));
  }
  options_.image_rate_hz = 0.05;
  EXPECT_THAT(MessageOf<ConfigError>([this] { Run(); }),
              HasSubstr("expected at least 20.1 s, which a pair takes at --rate 0.05 Hz"));
  options_.image_rate_hz = 20;
  options_.from_s = 1e300;
  EXPECT_THAT(MessageOf<ConfigError>([this] { Run(); }),
              AllOf(HasSubstr("--from: found 1e+300 s, expected less than the "),
                    HasSubstr("s that the motion lasts")));
  options_.from_s = 0;
  WriteFile(options_.scene, "walls: []\n");
  EXPECT_THROW(Run(), ConfigError);
}

}  // namespace
}  // namespace slcmap
