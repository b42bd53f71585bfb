#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "data/core/error.h"
#include "data/io/json.h"
#include "export/export.h"
#include "export/scene/formats.h"
#include "tests/testing/node_reader.h"
#include "tests/testing/small_sequence.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;

constexpr double kLength_m = 10, kHeight_m = 2.5, kDoorHeight_m = 2.1;
constexpr double kEdges_m[] = {1.0, 1.9, 4.2, 5.1, 7.3, 8.2};  // of dark doors, along the wall
constexpr int kImages = 20;

// Before the wall, and brighter than all of it.
const Eigen::AlignedBox3d kBox(Eigen::Vector3d(5.6, -0.6, 0), Eigen::Vector3d(6.2, -0.3, 1.0));

double GreyOfWall(double x_m, double z_m) {
  for (std::size_t i = 0; i + 1 < std::size(kEdges_m); i += 2) {
    if (x_m > kEdges_m[i] && x_m < kEdges_m[i + 1] && z_m < kDoorHeight_m) return 60;
  }
  return 170;
}

// The wall is the plane y = 0 from x = 0, seen from y < 0.
double GreyAlong(const Eigen::Vector3d& from, const Eigen::Vector3d& ray) {
  double enter = 0, leave = 1e9;
  for (int k = 0; k < 3; ++k) {
    const double a = (kBox.min()[k] - from[k]) / ray[k], b = (kBox.max()[k] - from[k]) / ray[k];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  if (enter < leave) return 240;
  const Eigen::Vector3d p = from - from.y() / ray.y() * ray;
  return ray.y() > 0 ? GreyOfWall(p.x(), p.z()) : 100;
}

// A camera whose images are bent, that looks at the wall from 2.4 m, turned a little to and fro.
class WallWalk {
 public:
  WallWalk() {
    camera_.width_px = 752;
    camera_.height_px = 480;
    camera_.fx_px = camera_.fy_px = 435;
    camera_.cx_px = 375.5;
    camera_.cy_px = 239.5;
    camera_.distortion = Distortion::kRadialTangential;
    camera_.coefficients << -0.28, 0.07, 2e-4, 2e-5;
  }

  Rig RectifiedRig() const {
    Rig rig;
    rig.cameras[0] = camera_;
    rig.cameras[0].distortion = Distortion::kNone;
    rig.cameras[0].coefficients.setZero();
    return rig;
  }

  // Of the camera, which is the body.
  static RigidTransform MakePose(int image) {
    Eigen::Matrix3d R;
    R << 1, 0, 0, 0, 0, 1, 0, -1, 0;
    const double turn_rad = 0.25 * std::sin(1.3 * image);
    return {Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()) * R),
            {0.25 + 0.5 * image, -2.4 + 0.2 * std::cos(0.7 * image), 1.3}};
  }

  // Each image with an exposure of its own.
  cv::Mat Render(int image) const {
    const RigidTransform T_world_camera = MakePose(image);
    const Eigen::Matrix3d R_world_camera = T_world_camera.rotation.toRotationMatrix();
    const double exposure = 1 + 0.15 * std::sin(2.1 * image);
    cv::Mat grey(camera_.height_px, camera_.width_px, CV_8UC1);
    auto ray = rays_.begin();
    for (uint8_t& pixel : cv::Mat_<uint8_t>(grey)) {
      double sum = 0;
      for (int i = 0; i < kFine * kFine; ++i) {
        sum += GreyAlong(T_world_camera.translation, R_world_camera * *ray++);
      }
      pixel = cv::saturate_cast<uint8_t>(exposure * sum / (kFine * kFine));
    }
    return grey;
  }

  void Write(const testing::TempFolder& folder) {
    for (int y = 0; y < camera_.height_px; ++y) {
      for (int x = 0; x < camera_.width_px; ++x) {
        for (int i = 0; i < kFine * kFine; ++i) {
          const Eigen::Vector2d px(x - 0.25 + 0.5 * (i % kFine), y - 0.25 + 0.5 * (i / kFine));
          rays_.push_back(camera_.Unproject(px).value_or(Eigen::Vector3d::UnitZ()));
        }
      }
    }
    std::string rows = "#timestamp [ns],filename\n";
    for (int i = 0; i < kImages; ++i) {
      rows += fmt::format("{0},{0}.png\n", testing::ImageStamp(i));
      const std::string name = fmt::format("mav0/cam0/data/{}.png", testing::ImageStamp(i));
      folder.Write(name, "");
      cv::imwrite(folder.Path(name), Render(i), {cv::IMWRITE_PNG_COMPRESSION, 1});
    }
    folder.Write("mav0/cam0/data.csv", rows);
    folder.Write("mav0/cam0/sensor.yaml",
                 "sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n"
                 "  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"
                 "rate_hz: 20\nresolution: [752, 480]\ncamera_model: pinhole\n"
                 "intrinsics: [435, 435, 375.5, 239.5]\n"
                 "distortion_model: radial-tangential\n"
                 "distortion_coefficients: [-0.28, 0.07, 2.0e-4, 2.0e-5]\n");
  }

 private:
  static constexpr int kFine = 2;  // rays across a pixel
  Camera camera_;
  std::vector<Eigen::Vector3d> rays_;  // of all pixels, in the camera
};

// The wall with an opening that nobody sees through, and the box as its cloud.
MapResult MapOfWall(const std::string& sequence) {
  MapResult map;
  map.source.sequence = sequence;
  map.source.opened.needs_imu = false;
  map.rectified_rig = WallWalk().RectifiedRig();
  for (int i = 0; i < kImages; ++i) {
    map.keyframes.push_back({testing::ImageStamp(i), WallWalk::MakePose(i)});
  }
  map.building.storeys = {{0, 0, kHeight_m}};
  BuildingPlane plane;
  plane.kind = PlaneKind::kWall;
  plane.normal = -Eigen::Vector3d::UnitY();
  plane.outline_world = {
      {0, 0, 0}, {kLength_m, 0, 0}, {kLength_m, 0, kHeight_m}, {0, 0, kHeight_m}};
  PlaneOpening window;
  window.kind = OpeningKind::kWindow;
  window.outline_world = {{2.5, 0, 1}, {3.5, 0, 1}, {3.5, 0, 2}, {2.5, 0, 2}};
  plane.openings = {window};
  map.building.planes = {plane};
  PlanWall wall;
  wall.start = {0, 0};
  wall.end = {kLength_m, 0};
  wall.thickness_m = 0.2;
  wall.plane_ids = {0};
  map.building.walls = {wall};
  const Eigen::Array3i steps = (kBox.sizes() / 0.04).array().ceil().cast<int>();
  for (int x = 0; x <= steps.x(); ++x) {
    for (int y = 0; y <= steps.y(); ++y) {
      for (int z = 0; z <= steps.z(); ++z) {
        const Eigen::Array3i at(x, y, z);
        if ((at > 0).all() && (at < steps).all()) continue;  // within
        map.dense.push_back(
            {kBox.min() +
             kBox.sizes().cwiseProduct((at.cast<double>() / steps.cast<double>()).matrix())});
      }
    }
  }
  return map;
}

class OrthoTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    recording_ = new testing::TempFolder;
    WallWalk().Write(*recording_);
    WriteInto("out");
  }
  static void TearDownTestSuite() { delete recording_; }

  // Returns the bytes of the wall's image.
  static std::string WriteInto(const std::string& folder) {
    WriteOrtho({}, nullptr, recording_->Path(folder), MapOfWall(recording_->Path()));
    return ReadFile(recording_->Path(folder + "/ortho/wall_W0_a.png"));
  }

  // Alpha is the last of four channels.
  static cv::Mat Wall() {
    return cv::imread(recording_->Path("out/ortho/wall_W0_a.png"), cv::IMREAD_UNCHANGED);
  }

  static int ToColumn(double x_m) { return static_cast<int>(std::floor(x_m / 0.005)); }
  static int ToRow(double z_m) { return static_cast<int>(std::floor((kHeight_m - z_m) / 0.005)); }

  static testing::TempFolder* recording_;
  testing::TempFolder temp_;
};
testing::TempFolder* OrthoTest::recording_ = nullptr;

// Mean of grey over a stretch of heights, by column.
cv::Mat Profile(const cv::Mat& image, int from_row, int to_row) {
  cv::Mat grey, profile;
  cv::extractChannel(image, grey, 0);
  cv::reduce(grey.rowRange(from_row, to_row), profile, 0, cv::REDUCE_AVG, CV_64F);
  return profile;
}

// Where a profile crosses the middle between both sides, in pixels from the left border.
double CrossingNear(const cv::Mat& profile, int column) {
  const double before = profile.at<double>(column - 12), behind = profile.at<double>(column + 12);
  const double middle = 0.5 * (before + behind);
  for (int i = column - 12; i < column + 12; ++i) {
    const double a = profile.at<double>(i) - middle, b = profile.at<double>(i + 1) - middle;
    if (a * b <= 0 && a != b) return i + 0.5 + a / (a - b);
  }
  return NAN;
}

TEST_F(OrthoTest, EdgesOfAWallOfTenMetresAreWhereTheyAre) {
  const cv::Mat wall = Wall();
  ASSERT_EQ(wall.size(), cv::Size(2000, 500));
  const cv::Mat profile = Profile(wall, ToRow(1.9), ToRow(1.2));
  for (const double edge_m : kEdges_m) {
    EXPECT_NEAR(0.005 * CrossingNear(profile, ToColumn(edge_m)), edge_m, 0.003) << edge_m;
  }
}

TEST_F(OrthoTest, ExposuresAreLevelledAndSeamsAreBlended) {
  const cv::Mat profile = Profile(Wall(), ToRow(2.3), ToRow(2.2));
  double low = 255, high = 0, step = 0;
  for (int i = 100; i < profile.cols - 100; ++i) {
    low = std::min(low, profile.at<double>(i));
    high = std::max(high, profile.at<double>(i));
    step = std::max(step, std::abs(profile.at<double>(i) - profile.at<double>(i - 1)));
  }
  EXPECT_LT(high - low, 12);  // of 170, where exposures differ by 30 %
  EXPECT_LT(step, 1.5);
}

TEST_F(OrthoTest, WhatStandsBeforeAWallIsNotOnIt) {
  const cv::Mat wall = Wall();
  const cv::Mat part =
      wall(cv::Rect(cv::Point(ToColumn(5.3), ToRow(1.1)), cv::Point(ToColumn(6.5), ToRow(0.1))));
  cv::Mat grey, alpha;
  cv::extractChannel(part, grey, 0);
  cv::extractChannel(part, alpha, 3);
  EXPECT_LT(cv::countNonZero(grey > 215), 0.01 * static_cast<double>(part.total()));
  // Beside it, behind it from aside, the wall is seen.
  EXPECT_GT(cv::countNonZero(alpha), 0.5 * static_cast<double>(part.total()));
}

TEST_F(OrthoTest, OpeningsAreTransparent) {
  cv::Mat alpha;
  cv::extractChannel(Wall(), alpha, 3);
  EXPECT_EQ(alpha.at<uint8_t>(ToRow(1.5), ToColumn(3.0)), 0);
  EXPECT_EQ(alpha.at<uint8_t>(ToRow(1.5), ToColumn(2.51)), 255);  // its edge
  EXPECT_EQ(alpha.at<uint8_t>(ToRow(1.5), ToColumn(2.2)), 255);
}

TEST_F(OrthoTest, TheListSaysWhereImagesLie) {
  ParseJsonFile(recording_->Path("out/ortho/orthophotos.json"), [](const Json& json) {
    CheckFormat("", json, "slcmap orthophotos", 1, 1);
    const Json& face = json.at("faces").at(0);
    EXPECT_EQ(face.at("file"), "wall_W0_a.png");
    EXPECT_EQ(face.at("wall"), 0);
    EXPECT_EQ(face.at("corners_m"), Json::parse("[[0,0,2.5],[10,0,2.5],[10,0,0],[0,0,0]]"));
    EXPECT_GT(face.at("seen_share").get<double>(), 0.9);
    return 0;
  });
  EXPECT_EQ(ReadFile(recording_->Path("out/ortho/wall_W0_a.pgw")),
            "0.005000\n0\n0\n-0.005000\n0.002500\n2.497500\n");
}

TEST_F(OrthoTest, AreTheSameWithAnyNumberOfThreads) {
  const int threads = cv::getNumThreads();
  cv::setNumThreads(threads == 1 ? 4 : 1);
  const std::string others = WriteInto("threads");
  cv::setNumThreads(threads);
  EXPECT_TRUE(others == ReadFile(recording_->Path("out/ortho/wall_W0_a.png")));
}

TEST_F(OrthoTest, AreWrittenWhereTheyAreAskedForAndThenAlsoInGltf) {
  const MapResult map = MapOfWall(recording_->Path());
  ExportOptions options;
  ExportMap(map, temp_.Path("all"), options);
  EXPECT_FALSE(std::filesystem::exists(temp_.Path("all/ortho")));
  options.formats = {"glb", "ortho"};
  ExportMap(map, temp_.Path("both"), options);
  EXPECT_TRUE(std::filesystem::exists(temp_.Path("both/ortho/wall_W0_a.png")));
  EXPECT_THAT(ReadFile(temp_.Path("both/scene.glb")), HasSubstr("orthophotos/storey 0/wall_W0_a"));
  if (!testing::HasNodeReader("gltf-validator")) {
    GTEST_SKIP() << testing::NodeReaderMissing("gltf-validator");
  }
  const auto output = testing::RunNodeReader("validate_gltf.mjs", temp_.Path("both/scene.glb"));
  EXPECT_EQ(output.status, 0) << output.text;
}

TEST_F(OrthoTest, AMissingRecordingIsNamed) {
  EXPECT_THAT([&] { WriteOrtho({}, nullptr, temp_.Path("out"), MapOfWall("/nowhere")); },
              ::testing::ThrowsMessage<DataError>(HasSubstr("--sequence names where it moved")));
}

}  // namespace
}  // namespace slcmap
