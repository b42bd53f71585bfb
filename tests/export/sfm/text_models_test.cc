#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "data/core/error.h"
#include "data/io/file.h"
#include "export/export.h"
#include "export/scene/formats.h"
#include "export/sfm/model.h"
#include "mapping/map/map.h"
#include "tests/testing/hand_made_building.h"
#include "tests/testing/pinhole_camera.h"
#include "tests/testing/reader_program.h"
#include "tests/testing/small_sequence.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;

std::vector<std::string> CollectRows(const std::string& path) {
  std::vector<std::string> rows;
  std::istringstream text(ReadFile(path));
  for (std::string row; std::getline(text, row);) {
    if (row.empty() || row[0] != '#') rows.push_back(row);
  }
  return rows;
}

// Two keyframes of a stereo camera that looks along x of the body.
MapResult MakeMapWithCameras() {
  MapResult map = testing::MakeTwoStoreys();
  Eigen::Matrix3d R_imu_camera;
  R_imu_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  for (std::size_t i = 0; i < 2; ++i) {
    map.rectified_rig.cameras[i] = testing::PinholeCamera(640, 480, 400, 319.5, 239.5);
    map.rectified_rig.T_imu_camera[i] = {Eigen::Quaterniond(R_imu_camera),
                                         {0, i == 0 ? 0.05 : -0.05, 0}};
  }
  const RigidTransform turned(ExpRotation({0, 0, 0.3}), {1, 2, 1.5});
  map.keyframes = {{1403636580000000000, {}}, {1403636581000000000, turned}};
  map.points = {{{4, 0.5, -0.2}, 0.01, 3, {}}, {{5, -1, 1}, 0.02, 4, {}}};
  return map;
}

// What the cameras of all keyframes see of a feature, `off_px` from there.
void SeeFeature(int64_t point, int track, const Eigen::Vector3d& p_world, double off_px,
                MapResult* map) {
  const Rig& rig = map->rectified_rig;
  for (const StampedPose& pose : map->keyframes) {
    for (int i = 0; i < 2; ++i) {
      const RigidTransform T_world_camera = pose.T_world_imu * rig.T_imu_camera[i];
      const auto px = rig.cameras[i].Project(T_world_camera.Inverse() * p_world);
      map->point_observations.push_back(
          {point, track, pose.stamp_ns, i, *px + Eigen::Vector2d(0, i == 0 ? off_px : -off_px)});
    }
  }
}

constexpr double kNoise_px = 0.2;

// Of the two points, the first is fused of two features that lie 6 cm apart.
MapResult MakeSeenMap() {
  MapResult map = MakeMapWithCameras();
  map.points[0].p_world = {8, 0.5, 0};
  map.points[1].p_world = {9, -1, 1};
  SeeFeature(0, 0, {8, 0.53, 0}, kNoise_px, &map);
  SeeFeature(0, 1, {8, 0.47, 0}, kNoise_px, &map);
  SeeFeature(1, 0, {9.02, -1, 1}, kNoise_px, &map);
  return map;
}

class TextModelsTest : public ::testing::Test {
 protected:
  testing::TempFolder temp_;
};

TEST_F(TextModelsTest, ColmapProjectsPointsToWhereTheRigDoes) {
  const MapResult map = MakeMapWithCameras();
  WriteColmap("", {}, temp_.Path(), map);
  const std::vector<std::string> cameras = CollectRows(temp_.Path("colmap/cameras.txt"));
  ASSERT_EQ(cameras.size(), 2u);
  EXPECT_EQ(cameras[0],
            "1 PINHOLE 640 480 400.000000000 400.000000000 320.000000000 240.000000000");
  const std::vector<std::string> images = CollectRows(temp_.Path("colmap/images.txt"));
  ASSERT_EQ(images.size(), 8u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(images[2 * i + 1], "");
    std::istringstream row(images[2 * i]);
    int id = 0, camera = 0;
    Eigen::Quaterniond q;
    Eigen::Vector3d t;
    std::string name;
    row >> id >> q.w() >> q.x() >> q.y() >> q.z() >> t.x() >> t.y() >> t.z() >> camera >> name;
    EXPECT_EQ(id, static_cast<int>(i) + 1);
    const std::size_t side = i % 2;
    EXPECT_EQ(camera, static_cast<int>(side) + 1);
    EXPECT_EQ(name, "cam" + std::to_string(side) + "/data/" +
                        std::to_string(map.keyframes[i / 2].stamp_ns) + ".png");
    const RigidTransform T_world_camera =
        map.keyframes[i / 2].T_world_imu * map.rectified_rig.T_imu_camera[side];
    const Eigen::Vector3d p_camera = T_world_camera.Inverse() * map.points[0].p_world;
    EXPECT_LT((q * map.points[0].p_world + t - p_camera).norm(), 1e-8);
  }
}

// Of each feature one, and not where the map has them fused.
TEST_F(TextModelsTest, ColmapsPointsAreWhereTheirTracksSeeThem) {
  const MapResult map = MakeSeenMap();
  const std::vector<ModelPoint> points = ModelPoints(map, ModelImages(map));
  ASSERT_EQ(points.size(), 3u);
  const Eigen::Vector3d features[] = {{8, 0.53, 0}, {8, 0.47, 0}, {9.02, -1, 1}};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_LT((points[i].p_world - features[i]).norm(), 1e-3) << i;
    EXPECT_EQ(points[i].track.size(), 4u);
    EXPECT_NEAR(points[i].error_px, kNoise_px, 0.01);
  }
}

TEST_F(TextModelsTest, SightsOfSomethingElseAreInNoTrack) {
  MapResult map = MakeSeenMap();
  map.point_observations[2].px.x() += 30;
  // Of the last feature only one sight is left that the others agree with.
  map.point_observations.erase(map.point_observations.begin() + 10,
                               map.point_observations.begin() + 12);
  map.point_observations[9].px.y() += 60;
  const std::vector<ModelPoint> points = ModelPoints(map, ModelImages(map));
  ASSERT_EQ(points.size(), 3u);
  EXPECT_EQ(points[0].track.size(), 3u);
  for (const ModelObservation& sight : points[0].track) EXPECT_NE(sight.image, 2u);
  EXPECT_LT((points[0].p_world - Eigen::Vector3d(8, 0.53, 0)).norm(), 0.02);
  EXPECT_EQ(points[1].track.size(), 4u);
  EXPECT_TRUE(points[2].track.empty());
  EXPECT_EQ(points[2].error_px, -1);
  EXPECT_EQ(points[2].p_world, map.points[1].p_world);
}

class ColmapTest : public TextModelsTest {
 protected:
  void SetUp() override { SLCMAP_NEEDS_READER("colmap"); }

  // Of a command on the model, which has to succeed.
  std::string Colmap(const std::string& command) const {
    return testing::OutputOf("QT_QPA_PLATFORM=offscreen colmap " + command);
  }
  const std::string model_ = temp_.Path("colmap");
};

TEST_F(ColmapTest, ReadsTheModel) {
  WriteColmap("", {}, temp_.Path(), MakeSeenMap());
  const std::string text = Colmap("model_analyzer --path " + model_);
  for (const char* found : {"Cameras: 2", "Images: 4", "Registered images: 4", "Points: 3",
                            "Observations: 12", "Mean track length: 4.0", "error: 0.200000px"}) {
    EXPECT_THAT(text, HasSubstr(found));
  }
  WriteColmap("", {}, temp_.Path(), MakeMapWithCameras());  // without tracks
  EXPECT_THAT(Colmap("model_analyzer --path " + model_), HasSubstr("Points: 2"));
}

// It finds the same errors, and next to nothing to improve.
TEST_F(ColmapTest, AdjustsTheModel) {
  MapResult map = MakeSeenMap();
  for (int64_t i = 2; i < 40; ++i) {
    const double angle = 0.7 * static_cast<double>(i);
    map.points.push_back(
        {{9 + std::sin(3 * angle), 2 * std::cos(angle), 2 * std::sin(angle)}, 0.01, 3, {}});
    SeeFeature(i, 0, map.points.back().p_world, kNoise_px, &map);
  }
  WriteColmap("", {}, temp_.Path(), map);
  const std::string adjusted = temp_.Path("adjusted");
  std::filesystem::create_directory(adjusted);
  const std::string text = Colmap(
      "bundle_adjuster --BundleAdjustment.refine_focal_length 0 "
      "--BundleAdjustment.refine_extra_params 0 --input_path " +
      model_ + " --output_path " + adjusted);
  const auto cost_px = [&](const std::string& name) {
    const std::size_t at = text.find(name + " cost : ");
    return at == std::string::npos ? 1e9 : std::stod(text.substr(at + name.size() + 8));
  };
  EXPECT_LT(cost_px("Initial"), 1.1 * kNoise_px) << text;
  EXPECT_LE(cost_px("Final"), cost_px("Initial")) << text;
}

TEST_F(TextModelsTest, ImagesOfAMergedMapAreNamedAsTheirRecordingsHaveThem) {
  MapResult map = MakeMapWithCameras();
  const auto run = [&](const char* id, const char* sequence, int64_t moved_ns, std::size_t pose) {
    const int64_t stamp_ns = map.keyframes[pose].stamp_ns;
    map.source.merged.push_back(
        {id, sequence, "0.1.0", moved_ns, {}, StampSpan{stamp_ns, stamp_ns}});
  };
  run("a", "/recordings/day/mav0", 0, 0);
  run("b", "/recordings/night/", 1'000'000'000'000, 1);
  const auto names = [&] {
    std::vector<std::string> of_left;
    for (const ModelImage& image : ModelImages(map)) {
      if (image.camera == 0) of_left.push_back(image.name);
    }
    return of_left;
  };
  using ::testing::ElementsAre;
  EXPECT_THAT(names(), ElementsAre("day/cam0/data/1403636580000000000.png",
                                   "night/cam0/data/1403635581000000000.png"));
  EXPECT_EQ(ModelImages(map)[3].name, "night/cam1/data/1403635581000000000.png");
  // What does not tell them apart, or would end a name, is not taken.
  for (const char* sequence : {"/other/day", "", "/recordings/a night", "/recordings/.."}) {
    map.source.merged[1].sequence = sequence;
    EXPECT_THAT(names()[1], ::testing::StartsWith("b/cam0/data/1403635581")) << sequence;
  }
  map.source.merged[0].run_id = map.source.merged[1].run_id = "";
  EXPECT_THAT(names()[1], ::testing::StartsWith("run_1/cam0/data/1403635581"));
  // Merged by an earlier version, which did not say which poses are whose.
  map.source.merged[1].poses_ns.reset();
  EXPECT_EQ(names()[1], "cam0/data/1403636581000000000.png");
}

TEST_F(TextModelsTest, ImagesAreNamedByTheCamerasThatWereUsed) {
  MapResult map = MakeMapWithCameras();
  map.source.opened.cameras = {1, 2};
  EXPECT_EQ(ModelImages(map)[0].name, "cam1/data/1403636580000000000.png");
  EXPECT_EQ(ModelImages(map)[1].name, "cam2/data/1403636580000000000.png");
  map.source.merged = {{"a", "/recordings/day", "0.1.0", 0, {}, StampSpan{0, INT64_MAX}}};
  map.source.merged[0].opened.cameras = {2, 0};
  EXPECT_EQ(ModelImages(map)[0].name, "day/cam2/data/1403636580000000000.png");
  EXPECT_EQ(ModelImages(map)[1].name, "day/cam0/data/1403636580000000000.png");
}

TEST_F(TextModelsTest, LimapHoldsTheLines) {
  WriteLimap(temp_.Path(), MakeMapWithCameras());
  const std::vector<std::string> tracks = CollectRows(temp_.Path("limap/alltracks.txt"));
  ASSERT_EQ(tracks.size(), 1 + 3 * 5u);
  EXPECT_EQ(tracks[0], "3");
  EXPECT_EQ(tracks[11], "2 0 0");
  EXPECT_EQ(tracks[13], "1.0000000000 1.0000000000 4.2345000000");
  EXPECT_EQ(tracks[14], "");
  const std::vector<std::string> rows = CollectRows(temp_.Path("limap/lines.txt"));
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0],
            "1 0.0000000000 0.0000000000 -0.5000000000 8.0000000000 0.0000000000 -0.5000000000 0");
}

// Line 0 in two pieces, seen by three images, of which one is no keyframe's.
MapResult MakeSupportedMap() {
  MapResult map = MakeMapWithCameras();
  map.lines.insert(map.lines.begin() + 1, map.lines[0]);
  map.trajectory = {map.keyframes[0], {1403636580500000000, {}}, map.keyframes[1]};
  const auto see = [&](int piece, std::size_t pose, int camera, const LineSegment& px) {
    map.line_evidence.supports.push_back({0, piece, map.trajectory[pose].stamp_ns, camera, px});
  };
  see(0, 0, 0, {{10, 20}, {30, 40.25}});
  see(0, 0, 1, {{9, 20}, {28, 40}});
  see(0, 1, 1, {{1, 2}, {3, 4}});
  see(1, 0, 0, {{100, 20}, {130, 40}});
  return map;
}

TEST_F(TextModelsTest, LimapHoldsTheSupports) {
  WriteLimap(temp_.Path(), MakeSupportedMap());
  const std::vector<std::string> tracks = CollectRows(temp_.Path("limap/alltracks.txt"));
  ASSERT_EQ(tracks.size(), 1 + 4 * 5u);
  EXPECT_EQ(tracks[1], "0 3 3");
  EXPECT_EQ(tracks[4], "1 2 4 ");  // images
  EXPECT_EQ(tracks[5], "0 0 0 ");  // the first segment of each
  EXPECT_EQ(tracks[6], "1 1 1");
  EXPECT_EQ(tracks[9], "1 ");
  EXPECT_EQ(tracks[10], "1 ");
  EXPECT_EQ(tracks[11], "2 0 0");
  const std::vector<std::string> rows = CollectRows(temp_.Path("limap/lines.txt"));
  ASSERT_EQ(rows.size(), 4u);
  // Pixels as cameras.txt has them: the corner of the first is the origin.
  EXPECT_THAT(rows[0], ::testing::EndsWith(" 3 1 0 10.50 20.50 30.50 40.75 2 0 9.50 20.50 28.50 "
                                           "40.50 4 0 1.50 2.50 3.50 4.50"));
  EXPECT_THAT(rows[1], ::testing::EndsWith(" 1 1 1 100.50 20.50 130.50 40.50"));
  EXPECT_THAT(rows[2], ::testing::EndsWith(" 0"));
  // What limap's tracks refer to is in COLMAP's model.
  WriteColmap("", {}, temp_.Path(), MakeSupportedMap());
  const std::vector<std::string> images = CollectRows(temp_.Path("colmap/images.txt"));
  ASSERT_EQ(images.size(), 12u);
  EXPECT_THAT(images[6], ::testing::StartsWith("4 "));
  EXPECT_THAT(images[6], ::testing::EndsWith(" 2 cam1/data/1403636580500000000.png"));
}

// Of the small sequence, whose cameras have distortion: two keyframes, rectified to the same
// pinholes without it.
MapResult MapOfSmallSequence(const testing::TempFolder& temp) {
  testing::WriteSequence(temp, {});
  MapResult map;
  map.source.sequence = temp.Path("");
  Eigen::Matrix3d R_imu_camera;
  R_imu_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  for (std::size_t i = 0; i < 2; ++i) {
    map.rectified_rig.cameras[i] = testing::PinholeCamera(96, 64, 60, 47.5, 31.5);
    map.rectified_rig.T_imu_camera[i].rotation = Eigen::Quaterniond(R_imu_camera);
  }
  map.keyframes = {{testing::ImageStamp(1), {}}, {testing::ImageStamp(3), {}}};
  return map;
}

TEST(RectifiedImages, AreWrittenUnderTheirNamesInTheModel) {
  const testing::TempFolder temp;
  const MapResult map = MapOfSmallSequence(temp);
  const auto paths = WriteColmap("rectified", {}, temp.Path("out"), map);
  EXPECT_EQ(paths.size(), 3u + 4);
  for (const ModelImage& image : ModelImages(map)) {
    const cv::Mat rectified =
        cv::imread(temp.Path("out/colmap/images/" + image.name), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(rectified.size(), cv::Size(96, 64)) << image.name;
    // A column beside the middle shows what the camera has nearer to it, by its distortion.
    const int index = image.stamp_ns == testing::ImageStamp(1) ? 1 : 3;
    const cv::Mat raw = testing::Texture(index, 4 * image.camera, {96, 64});
    const auto rows = cv::Range(28, 36);
    const auto grey = [&](const cv::Mat& of, int column) {
      return cv::mean(of(rows, cv::Range(column, column + 1)))[0];
    };
    for (const int off_px : {-30, 30}) {
      const double x = off_px / 60.0;
      const double bent_px = 60 * x * (1 - 0.1 * x * x + 0.01 * std::pow(x, 4));
      const double at_px = 47.5 + bent_px;
      const int left_px = static_cast<int>(std::floor(at_px));
      const double part = at_px - left_px;
      const double expected = (1 - part) * grey(raw, left_px) + part * grey(raw, left_px + 1);
      // Columns of rectified images are at 47.5 + off_px, between two pixels.
      const double found = 0.5 * (grey(rectified, 47 + off_px) + grey(rectified, 48 + off_px));
      EXPECT_NEAR(found, expected, 8) << image.name << " " << off_px;
    }
  }
}

TEST(RectifiedImages, ARecordingThatIsMissingOrAnotherIsNamed) {
  const testing::TempFolder temp;
  MapResult map = MapOfSmallSequence(temp);
  map.keyframes[0].stamp_ns += 1'000'000'000'000;
  map.keyframes[1].stamp_ns += 1'000'000'000'000;
  EXPECT_THAT([&] { WriteColmap("rectified", {}, temp.Path("out"), map); },
              ::testing::ThrowsMessage<DataError>(HasSubstr("found none of the 4 images")));
  map.source.sequence = temp.Path("moved");
  EXPECT_THAT([&] { WriteColmap("rectified", {}, temp.Path("out"), map); },
              ::testing::ThrowsMessage<DataError>(HasSubstr("--sequence names where it moved to")));
  ExportOptions raw;
  raw.colmap_images = "raw";
  EXPECT_THROW(CheckFormats(raw), ConfigError);
}

}  // namespace
}  // namespace slcmap
