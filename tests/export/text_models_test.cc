#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "data/file.h"
#include "export/colmap_writer.h"
#include "export/export.h"
#include "export/limap_writer.h"
#include "export/model_images.h"
#include "tests/testing/hand_made_building.h"
#include "tests/testing/node_reader.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;

std::vector<std::string> RowsOf(const std::string& path) {
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
    Camera& camera = map.rectified_rig.cameras[i];
    camera.width_px = 640;
    camera.height_px = 480;
    camera.fx_px = camera.fy_px = 400;
    camera.cx_px = 319.5;
    camera.cy_px = 239.5;
    map.rectified_rig.T_imu_camera[i] = {Eigen::Quaterniond(R_imu_camera),
                                         {0, i == 0 ? 0.05 : -0.05, 0}};
  }
  const RigidTransform turned(ExpRotation({0, 0, 0.3}), {1, 2, 1.5});
  map.keyframes = {{1403636580000000000, {}}, {1403636581000000000, turned}};
  map.points = {{{4, 0.5, -0.2}, 0.01, 3, {}}, {{5, -1, 1}, 0.02, 4, {}}};
  return map;
}

class TextModelsTest : public ::testing::Test {
 protected:
  testing::TempFolder temp_;
};

TEST_F(TextModelsTest, ColmapProjectsPointsToWhereTheRigDoes) {
  const MapResult map = MakeMapWithCameras();
  ColmapWriter().Write(temp_.Path(), map, {});
  const std::vector<std::string> cameras = RowsOf(temp_.Path("colmap/cameras.txt"));
  ASSERT_EQ(cameras.size(), 2u);
  EXPECT_EQ(cameras[0],
            "1 PINHOLE 640 480 400.000000000 400.000000000 320.000000000 240.000000000");
  const std::vector<std::string> images = RowsOf(temp_.Path("colmap/images.txt"));
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

TEST_F(TextModelsTest, ColmapReadsTheModel) {
  if (testing::RunReader("colmap help").status != 0) {
    GTEST_SKIP() << "colmap is not installed: apt-get install colmap";
  }
  ColmapWriter().Write(temp_.Path(), MakeMapWithCameras(), {});
  const auto output = testing::RunReader("QT_QPA_PLATFORM=offscreen colmap model_analyzer --path " +
                                         temp_.Path("colmap"));
  EXPECT_EQ(output.status, 0) << output.text;
  EXPECT_THAT(output.text, HasSubstr("Cameras: 2"));
  EXPECT_THAT(output.text, HasSubstr("Images: 4"));
  EXPECT_THAT(output.text, HasSubstr("Points: 2"));
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

TEST_F(TextModelsTest, LimapHoldsTheLines) {
  LimapWriter().Write(temp_.Path(), MakeMapWithCameras(), {});
  const std::vector<std::string> tracks = RowsOf(temp_.Path("limap/alltracks.txt"));
  ASSERT_EQ(tracks.size(), 1 + 3 * 5u);
  EXPECT_EQ(tracks[0], "3");
  EXPECT_EQ(tracks[11], "2 0 0");
  EXPECT_EQ(tracks[13], "1.0000000000 1.0000000000 4.2345000000");
  EXPECT_EQ(tracks[14], "");
  const std::vector<std::string> rows = RowsOf(temp_.Path("limap/lines.txt"));
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
  LimapWriter().Write(temp_.Path(), MakeSupportedMap(), {});
  const std::vector<std::string> tracks = RowsOf(temp_.Path("limap/alltracks.txt"));
  ASSERT_EQ(tracks.size(), 1 + 4 * 5u);
  EXPECT_EQ(tracks[1], "0 3 3");
  EXPECT_EQ(tracks[4], "1 2 4 ");  // images
  EXPECT_EQ(tracks[5], "0 0 0 ");  // the first segment of each
  EXPECT_EQ(tracks[6], "1 1 1");
  EXPECT_EQ(tracks[9], "1 ");
  EXPECT_EQ(tracks[10], "1 ");
  EXPECT_EQ(tracks[11], "2 0 0");
  const std::vector<std::string> rows = RowsOf(temp_.Path("limap/lines.txt"));
  ASSERT_EQ(rows.size(), 4u);
  // Pixels as cameras.txt has them: the corner of the first is the origin.
  EXPECT_THAT(rows[0], ::testing::EndsWith(" 3 1 0 10.50 20.50 30.50 40.75 2 0 9.50 20.50 28.50 "
                                           "40.50 4 0 1.50 2.50 3.50 4.50"));
  EXPECT_THAT(rows[1], ::testing::EndsWith(" 1 1 1 100.50 20.50 130.50 40.50"));
  EXPECT_THAT(rows[2], ::testing::EndsWith(" 0"));
}

// What limap's tracks refer to is in COLMAP's model.
TEST_F(TextModelsTest, ImagesThatLinesWereSeenInAreInTheModel) {
  ColmapWriter().Write(temp_.Path(), MakeSupportedMap(), {});
  const std::vector<std::string> images = RowsOf(temp_.Path("colmap/images.txt"));
  ASSERT_EQ(images.size(), 12u);
  EXPECT_THAT(images[6], ::testing::StartsWith("4 "));
  EXPECT_THAT(images[6], ::testing::EndsWith(" 2 cam1/data/1403636580500000000.png"));
}

TEST_F(TextModelsTest, AnEmptyMapReplacesTheFoldersOfAnEarlierOne) {
  ExportOptions options;
  options.formats = {"colmap", "limap"};
  const std::string folder = temp_.Path("export");
  ExportMap(MakeMapWithCameras(), folder, options);
  EXPECT_EQ(ExportMap({}, folder, options).size(), 5u);
  EXPECT_TRUE(RowsOf(folder + "/colmap/cameras.txt").empty());
  EXPECT_TRUE(RowsOf(folder + "/colmap/images.txt").empty());
  EXPECT_EQ(RowsOf(folder + "/limap/alltracks.txt").at(0), "0");
  options.formats = {"limap"};
  ExportMap({}, folder, options);
  EXPECT_FALSE(std::filesystem::exists(folder + "/colmap"));
}

}  // namespace
}  // namespace slcmap
