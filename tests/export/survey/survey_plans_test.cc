#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "data/core/error.h"
#include "data/io/json.h"
#include "export/scene/formats.h"
#include "mapping/plan/plan_files.h"
#include "tests/testing/hand_made_building.h"
#include "tests/testing/reader_program.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class SurveyPlanTest : public ::testing::Test {
 protected:
  // A layer as GDAL reads it, as CSV without quotes, the geometry first.
  std::string Csv(const std::string& file, const std::string& layer) const {
    std::string csv = testing::OutputOf("ogr2ogr -f CSV /vsistdout/ '" + file + "' " + layer +
                                        " -lco GEOMETRY=AS_WKT -lco SEPARATOR=SEMICOLON");
    std::erase(csv, '"');
    return csv;
  }

  testing::TempFolder temp_;
};

TEST_F(SurveyPlanTest, GdalReadsAllLayersOfAGeoPackage) {
  SLCMAP_NEEDS_READER("ogr2ogr");
  MapResult map = testing::MakeTwoStoreys();
  map.building.rooms[0].name = "Kitchen; \"old\"";
  map.building.walls[0].openings[1].name = "W 7";
  const std::string path = WriteGeoPackage(temp_.Path(), map).at(0);
  const std::string walls = Csv(path, "walls");
  EXPECT_THAT(walls, HasSubstr("WKT;storey;id;thickness_m;thickness_assumed;height_m;sigma_m"));
  // Between its doorway, its window and its passage; 2.7 m high.
  EXPECT_THAT(walls, HasSubstr("MULTIPOLYGON (((0 6,1 6,1.0 6.24,"));
  EXPECT_THAT(walls, HasSubstr(";0;0;0.24;0;2.7;0.004"));
  EXPECT_THAT(walls, HasSubstr(";0;2;0.15;1;2.7;0.004"));
  EXPECT_THAT(walls, HasSubstr(";1;3;0.2;0;;0.004")) << "nobody saw how high it is";
  const std::string rooms = Csv(path, "rooms");
  EXPECT_THAT(rooms, HasSubstr("((0 0,8 0,8 6,0 6,0 0),(3 2,3 3,4 3,4 2,3 2))"));
  EXPECT_THAT(rooms, HasSubstr(";0;0;Kitchen; old;47;-0.5;2.7;0.9"));
  const std::string openings = Csv(path, "openings");
  EXPECT_THAT(openings, HasSubstr("LINESTRING (1.0 6.12,1.9 6.12);0;0;;door;0.9;2.05;0;1"));
  EXPECT_THAT(openings, HasSubstr(";W 7;window;1.5;1.2;0.9;0"));
  const std::string lines = Csv(path, "lines");
  EXPECT_THAT(lines, HasSubstr("LINESTRING Z (0 0 3.1,1 1 4.2345);1;2;"));
  EXPECT_THAT(testing::OutputOf("ogrinfo -so '" + path + "' walls"), HasSubstr("ENGCRS[\"building"))
      << "a frame of its own";
  const auto asked = [&](const std::string& query) {
    return testing::OutputOf("ogrinfo -q '" + path + "' -sql \"" + query + "\"");
  };
  EXPECT_THAT(asked("SELECT HasSpatialIndex('walls', 'geom') AS has"),
              HasSubstr("HasSpatialIndex (Integer) = 1"));
  EXPECT_THAT(asked("SELECT max(maxx) AS far FROM rtree_rooms_geom WHERE minx < 1"),
              HasSubstr("far (Real) = 8"));
}

TEST_F(SurveyPlanTest, APlacedPlanLiesInItsGrid) {
  SLCMAP_NEEDS_READER("ogr2ogr");
  MapResult map = testing::MakeTwoStoreys();
  map.source.georeference = Georeference{"EPSG:25832", {451200, 5411300, 312}, 0.5 * M_PI, 1};
  const std::string path = WriteGeoPackage(temp_.Path(), map).at(0);
  EXPECT_THAT(testing::OutputOf("ogrinfo -so '" + path + "' walls"), HasSubstr("UTM zone 32N"));
  EXPECT_THAT(Csv(path, "rooms"), HasSubstr("451200 5411308"));
  EXPECT_THAT(Csv(path, "rooms"), HasSubstr(";47;311.5;2.7;")) << "heights too";
  EXPECT_THAT(Csv(path, "lines"), HasSubstr("315.1"));
}

TEST_F(SurveyPlanTest, GeoJsonOfAPlacedPlanIsInDegrees) {
  MapResult map = testing::MakeTwoStoreys();
  map.source.georeference = Georeference{"EPSG:25832", {451200, 5411300, 312}, 0, 1};
  const std::string path = WriteGeoJson(temp_.Path(), map).at(0);
  const Json plan = Json::parse(ReadFile(path));
  EXPECT_FALSE(plan.contains("crs"));
  const auto& room = *std::ranges::find_if(plan.at("features"), [](const Json& feature) {
    return feature.at("properties").at("feature") == "room";
  });
  // As gdaltransform has the origin.
  const Json& corner = room.at("geometry").at("coordinates").at(0).at(0);
  EXPECT_NEAR(corner.at(0).get<double>(), 8.3347663239847, 2e-9);
  EXPECT_NEAR(corner.at(1).get<double>(), 48.8527478389487, 2e-9);
  EXPECT_THAT([&] { ReadPlans(path, 0); }, ThrowsMessage<DataError>(HasSubstr("in metres")))
      << "degrees are no plan";
}

TEST_F(SurveyPlanTest, AGridOfAnotherPlaceIsTold) {
  MapResult map = testing::MakeTwoStoreys();
  map.source.georeference = Georeference{"EPSG:25832", {1e30, 5411300, 312}, 0, 1};
  EXPECT_THAT([&] { WriteGeoJson(temp_.Path(), map); },
              ThrowsMessage<DataError>(HasSubstr("EPSG:25832 does not reach")));
}

TEST_F(SurveyPlanTest, GeoJsonIsAFileAStorey) {
  const std::vector<std::string> paths = WriteGeoJson(temp_.Path(), testing::MakeTwoStoreys());
  EXPECT_THAT(paths,
              ElementsAre(EndsWith("plan/storey_0.geojson"), EndsWith("plan/storey_1.geojson")));
  const Json below = Json::parse(ReadFile(paths[0]));
  std::map<std::string, int> counts;
  for (const Json& feature : below.at("features")) {
    ++counts[feature.at("properties").at("feature").get<std::string>()];
  }
  EXPECT_EQ(counts,
            (std::map<std::string, int>{{"wall", 3}, {"room", 1}, {"opening", 3}, {"line", 2}}));
  EXPECT_THAT(WriteGeoJson(temp_.Path(), {}), ElementsAre(EndsWith("plan/no_storey.geojson")));
}

TEST_F(SurveyPlanTest, GdalReadsGeoJson) {
  SLCMAP_NEEDS_READER("ogr2ogr");
  const std::string path = WriteGeoJson(temp_.Path(), testing::MakeTwoStoreys()).at(0);
  const std::string text = testing::OutputOf("ogrinfo -al '" + path + "'");
  EXPECT_THAT(text, HasSubstr("Feature Count: 9"));
  EXPECT_THAT(text, HasSubstr("POLYGON ((0 0,8 0,8 6,0 6,0 0),(3 2,3 3,4 3,4 2,3 2))"));
  EXPECT_THAT(text, HasSubstr("ENGCRS[\"building")) << "no degrees";
  EXPECT_THAT(text, HasSubstr("area_m2 (Real) = 47"));
  EXPECT_THAT(text, HasSubstr("kind (String) = window"));
}

// Rooms and lines are no walls, and doors stay open.
TEST_F(SurveyPlanTest, AnExportedStoreyIsAPlanToRegisterIn) {
  const std::string path = WriteGeoJson(temp_.Path(), testing::MakeTwoStoreys()).at(0);
  const std::vector<BuildingPlan> plans = ReadPlans(path, 0);
  ASSERT_EQ(plans.size(), 1u);
  EXPECT_EQ(plans[0].openings.size(), 3u);
  EXPECT_LT((plans[0].openings[0].start - Eigen::Vector2d(1, 6.12)).norm(), 1e-5);
  double length_m = 0;
  for (const PlannedFace& face : plans[0].faces) length_m += face.Length();
  EXPECT_GT(length_m, 30);  // both sides of 8 + 6 + 5 m, less the openings
  EXPECT_LT(length_m, 40);
}

TEST_F(SurveyPlanTest, NumbersThatAreNoneAreTold) {
  MapResult map = testing::MakeTwoStoreys();
  map.lines[1].end_world.z() = std::numeric_limits<double>::infinity();
  EXPECT_THAT([&] { WriteGeoJson(temp_.Path(), map); },
              ThrowsMessage<DataError>(HasSubstr("map: lines: found a number that is not finite")));
}

}  // namespace
}  // namespace slcmap
