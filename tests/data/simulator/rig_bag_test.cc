// Each known rig, simulated in its topics and opened as any recording.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "data/core/error.h"
#include "data/io/file.h"
#include "data/rig/profile.h"
#include "data/simulator/simulation.h"
#include "data/source/convert_recording.h"
#include "data/source/sequence.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;

constexpr const char* kTinyRig = R"(
cam0: {camera_model: pinhole, intrinsics: [60, 61, 31, 23], resolution: [64, 48],
  distortion_model: radtan, distortion_coeffs: [-0.1, 0.02, 0.001, -0.002],
  T_imu_cam: [[0, 0, 1, 0.02], [-1, 0, 0, 0.01], [0, -1, 0, 0.03], [0, 0, 0, 1]]}
cam1: {camera_model: pinhole, intrinsics: [62, 63, 30, 24], resolution: [64, 48],
  distortion_model: equidistant, distortion_coeffs: [0.01, -0.02, 0.003, -0.001],
  T_cn_cnm1: [[0.8, 0, 0.6, -0.1], [0, 1, 0, 0.01], [-0.6, 0, 0.8, 0.005], [0, 0, 0, 1]]}
imu0: {gyroscope_noise_density: 1.0e-4, gyroscope_random_walk: 2.0e-5, update_rate: 200,
  accelerometer_noise_density: 3.0e-3, accelerometer_random_walk: 4.0e-4}
)";

// All pixels say which frame it is, of which camera.
class FlatPainter : public PairRenderer {
 public:
  explicit FlatPainter(const RenderTask& task) : rig_(task.rig) {}
  RenderedPair Render(int frame, bool) override {
    return {Flat(0, 10 + frame), Flat(1, 100 + frame), {}};
  }
  void WriteTruth(const std::string&, int) override {}

 private:
  cv::Mat Flat(size_t camera, int grey) const {
    return {rig_.cameras[camera].height_px, rig_.cameras[camera].width_px, CV_8U, cv::Scalar(grey)};
  }
  Rig rig_;
};

class RigBag : public ::testing::TestWithParam<std::string> {
 protected:
  RigBag() {
    WriteFile(folder_.Path("rig.yaml"), kTinyRig);
    WriteFile(
        folder_.Path("scene.yaml"),
        "trajectory: {kind: robot, waypoints_m: [[0, 0, 1], [1, 0, 1]], stand_still_s: 0.5}\n");
    options_.scene = folder_.Path("scene.yaml");
    options_.folder = folder_.Path("sequence");
    options_.rig = folder_.Path("rig.yaml");
    options_.image_rate_hz = 4;
    options_.profile = &KnownProfiles().at(GetParam());
    pairs_ =
        Simulate(
            options_, [](const RenderTask& task) { return std::make_unique<FlatPainter>(task); },
            [](const SimulationState&) { return true; })
            .pairs;
  }

  // Writes a row of the profile's topics and opens it without any option.
  Sequence WriteAndOpen(const RigLayout& layout, const std::string& form, bool as_files) {
    const std::string path = folder_.Path(form == "db3" ? "walk" : "walk." + form);
    std::filesystem::remove_all(path);
    const auto recording = OpenTables(options_.folder, {});
    WriteBagRecording(*recording, {}, {form, "none"}, as_files, path, {}, layout);
    return OpenSequence(path);
  }

  testing::TempFolder folder_;
  SimulationOptions options_;
  int pairs_ = 0;
};

void ExpectCameras(const Rig& told, const Rig& read) {
  for (size_t i = 0; i < (IsStereo(read) ? 2 : 1); ++i) {
    const Camera &a = told.cameras[i], &b = read.cameras[i];
    EXPECT_EQ(a.distortion, b.distortion);
    EXPECT_EQ(a.coefficients, b.coefficients);
    EXPECT_EQ(cv::Size(a.width_px, a.height_px), cv::Size(b.width_px, b.height_px));
    EXPECT_EQ(Eigen::Vector4d(a.fx_px, a.fy_px, a.cx_px, a.cy_px),
              Eigen::Vector4d(b.fx_px, b.fy_px, b.cx_px, b.cy_px));
    const Eigen::Matrix4d pose = told.T_imu_camera[i].Matrix();
    EXPECT_LT((pose - read.T_imu_camera[i].Matrix()).norm(), 1e-9) << "of camera " << i;
  }
}

uchar ReadGrey(const Sequence& sequence, const std::string& path) {
  const cv::Mat pixels = ReadGrayImage(*sequence.store, path, {}, {}).image;
  return pixels.empty() ? 0 : pixels.at<uchar>(pixels.rows / 2, pixels.cols / 2);
}

TEST_P(RigBag, OpensWithoutOptionsAsItWasTold) {
  const RigProfile& profile = *options_.profile;
  Warnings warnings;
  const Rig seen = OpenTables(options_.folder, {})->FindCalibration({}, {}, &warnings).rig;
  Rig raw = ReadSimulatedRig(options_.rig);
  for (size_t row = 0; row < profile.topics.size(); ++row) {
    SCOPED_TRACE(row);
    RigLayout layout = LayoutFor(profile, seen, row);
    if (layout.kind == ImageKind::kRaw && profile.resolutions_px.empty()) layout.rig = raw;
    const bool as_files = row % 2 == 1;
    const char* const form = std::array{"bag", "mcap", "db3"}[row % 3];
    const Sequence opened = WriteAndOpen(layout, form, as_files);
    EXPECT_THAT(opened.calibration_source, HasSubstr("profile " + profile.name));
    RecordingTopics topics = layout.topics;
    for (std::string* name : {&topics.left, &topics.right}) {
      if (as_files && !name->empty()) *name += "/compressed";
    }
    EXPECT_EQ(opened.opened.topics, TopicsText(topics));
    EXPECT_EQ(IsStereo(opened.rig), !topics.right.empty());
    ExpectCameras(layout.rig, opened.rig);
    EXPECT_EQ(opened.rig.camera_time_offset_s, profile.camera_time_offset_s.value_or(0));
    if (profile.imu_noise) {
      EXPECT_EQ(opened.rig.imu_noise.accel_walk_m_s3_sqrthz,
                profile.imu_noise->accel_walk_m_s3_sqrthz);
    }
    ASSERT_EQ(opened.images.size(), static_cast<size_t>(pairs_));
    EXPECT_GT(opened.imu.size(), 300u);
    EXPECT_EQ(ReadGrey(opened, opened.images[3].left_path), 13);
    if (topics.right.empty()) continue;
    EXPECT_EQ(ReadGrey(opened, opened.images[3].right_path), 103);
  }
}

std::vector<std::string> ProfileNames() {
  std::vector<std::string> names;
  for (const auto& [name, profile] : KnownProfiles()) names.push_back(name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(All, RigBag, ::testing::ValuesIn(ProfileNames()),
                         [](const auto& test) { return test.param; });

TEST(RigLayout, LensesThatCameraInfoHasNoWordsForAreRefused) {
  RigLayout layout;
  layout.rig.cameras[0].distortion = Distortion::kOmni;
  EXPECT_THAT(testing::MessageOf<ConfigError>([&] { layout.Info(0); }), HasSubstr("omni"));
}

}  // namespace
}  // namespace slcmap
