// A room whose walls have tags, mapped at true poses and placed on what its truth says of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/io/file.h"
#include "mapping/map/map_folder.h"
#include "tests/integration/slcmap_process.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using testing::ExpectError;
using testing::ExpectSuccess;
using ::testing::HasSubstr;
using testing::ProcessResult;
using testing::RunSlcmap;

constexpr char kScene[] = R"(
georeference: {crs: "EPSG:25832", origin_m: [691604.2, 5334750.6, 515.3], turn_deg: 33}
objects:
  - {kind: wall, points: [[-2, -2], [4, -2], [4, 2], [-2, 2]], closed: true, height: 3,
     material: brick}
  - {kind: slab, at: [-2, -2, 0], size: [6, 4], material: carpet}
  - {kind: lamp, at: [1, 0, 2.9], size: [1, 0.5], radiance: 30}
  - {kind: tag, name: "tag36h11:1", at: [4, -0.8, 0.7], yaw_deg: -90, size: 0.3}
  - {kind: tag, name: "tag36h11:2", at: [4, 0.8, 0.8], yaw_deg: -90, size: 0.3}
  - {kind: tag, name: "tag36h11:3", at: [4, 0.7, 1.7], yaw_deg: -90, size: 0.3}
  - {kind: tag, name: "tag36h11:4", at: [3, 2, 1.2], size: 0.3}
trajectory: {kind: robot, waypoints_m: [[-1, 0, 1], [0.5, 0, 1]], stand_still_s: 0.2}
)";

class GeoreferenceCommand : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    ExpectSuccess("-q simulate " + folder_.Write("scene.yaml", kScene) + " --rig " +
                  folder_.Write("rig.yaml", testing::RigYaml(5)) + " --rate 5 -o " + Path("seq"));
    folder_.Write("config.yaml", "mapping: {stages: {building: false, lines: false}}\n");
    mapped_ = RunSlcmap("map " + Path("seq") + " --poses " + Path("seq/truth/trajectory.tum") +
                        " --control " + Path("seq/truth/control.csv") + " --crs EPSG:25832" +
                        " --config " + Path("config.yaml") + " -o " + Path("map"));
  }

  static std::string Path(const std::string& name) { return folder_.Path(name); }
  static ProcessResult Georeference(const std::string& options) {
    return RunSlcmap("georeference " + Path("map") + " -o " + Path("placed") + " " + options);
  }

  inline static const testing::TempFolder folder_;
  inline static ProcessResult mapped_;
};

TEST_F(GeoreferenceCommand, AMapIsPlacedOnItsTags) {
  ASSERT_EQ(mapped_.exit_code, 0) << mapped_.error;
  EXPECT_THAT(mapped_.error, HasSubstr("4 of 4 control points place the map"));
  const MapResult map = ReadMapFolder(Path("map"));
  EXPECT_LT(map.control->rms_m, 0.03);  // images are small and far: known to 5 cm
  // Of poses that are true the world is that of the scene, turned along its walls.
  const Eigen::Vector3d corner_m = *map.source.georeference * map.source.T_world_run.translation;
  EXPECT_LT((corner_m - Eigen::Vector3d(691604.2, 5334750.6, 515.3)).norm(), 0.1);
}

TEST_F(GeoreferenceCommand, PlacesAMapThatIsThere) {
  const ProcessResult placed = Georeference("--control " + Path("seq/truth/control.csv") +
                                            " --distance tag36h11:1,tag36h11:2,1.6031");
  EXPECT_EQ(placed.exit_code, 0) << placed.error;
  EXPECT_THAT(placed.error, AllOf(HasSubstr("from 'tag36h11:1' to 'tag36h11:2': given 1.6031 m"),
                                  HasSubstr("4 of 4 control points")));
  EXPECT_EQ(ReadMapFolder(Path("placed")).source.georeference->crs, "");
}

TEST_F(GeoreferenceCommand, RefusesWhatCannotBe) {
  const std::string control = testing::ReadText(Path("seq/truth/control.csv"));
  const std::string header = "name,easting_m,northing_m,height_m,sigma_m";
  const std::string swapped = folder_.Write(
      "swapped.csv", "name,northing_m,easting_m,height_m,sigma_m" + control.substr(header.size()));
  const ProcessResult of_a_grid = Georeference("--control " + swapped);
  EXPECT_EQ(of_a_grid.exit_code, 1);
  EXPECT_THAT(of_a_grid.error, HasSubstr("swap the columns"));
  ExpectError(Georeference("-q --control " + swapped + " --crs EPSG:25832"), 1, "swap the columns");
  ExpectError(Georeference("-q --control " + Path("seq/truth/control.csv") + " --crs EPSG:4326"), 2,
              "degrees");
  ExpectError(Georeference("-q"), 2, "expected --control or --distance");
  const ProcessResult of_none =
      Georeference("--control " + folder_.Write("none.csv", "name,x,y,z\ntag36h11:77,1,2,3\n"));
  EXPECT_EQ(of_none.exit_code, 1);
  EXPECT_THAT(of_none.error, HasSubstr("found 0 of 1 control points"));
}

}  // namespace
}  // namespace slcmap
