#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <tuple>

#include "data/core/error.h"
#include "data/io/file.h"
#include "export/cad/ifc_file.h"
#include "export/scene/formats.h"
#include "tests/export/cad/ifc_rules.h"
#include "tests/testing/hand_made_building.h"
#include "tests/testing/made_building.h"
#include "tests/testing/node_reader.h"
#include "tests/testing/shared_data.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::IfcProduct;
using testing::IfcProducts;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::StepEntities;
using testing::StepEntity;

class IfcWriterTest : public ::testing::Test {
 protected:
  std::string Write(const MapResult& map, bool line_solids = false) const {
    WriteIfc(line_solids, temp_.Path(), map);
    return ReadFile(Path());
  }
  std::string Path() const { return temp_.Path("map.ifc"); }

  testing::TempFolder temp_;
};

int CountMatching(const StepEntities& entities, const std::string& type) {
  int count = 0;
  for (const auto& [reference, entity] : entities) count += entity.type == type ? 1 : 0;
  return count;
}

TEST(StepFileTest, NumbersAndTextsAreAsTheStandardHasThem) {
  EXPECT_EQ(StepReal(2), "2.");
  EXPECT_EQ(StepReal(-1e-9), "0.");
  EXPECT_EQ(StepReal(-12.3456789), "-12.345679");
  EXPECT_EQ(StepText("it's a\\b"), "'it''s a\\\\b'");
  EXPECT_EQ(StepText("B\xc3\xbcro\n"), "'B\\X2\\00FC\\X0\\ro\\X2\\000A\\X0\\'");
  EXPECT_EQ(StepText("\xf0\x9f\x8f\xa0"), "'\\X4\\0001F3E0\\X0\\'");
  EXPECT_EQ(StepText("a\xff"), "'a\\X2\\FFFD\\X0\\'");
  EXPECT_THROW(StepReal(std::numeric_limits<double>::quiet_NaN()), DataError);
}

TEST_F(IfcWriterTest, KeepsToTheRules) {
  const std::string text = Write(testing::MakeTwoStoreys(), true);
  EXPECT_THAT(testing::FindIfcFaults(text), IsEmpty());
  const StepEntities entities = testing::ParseStep(text);
  for (const auto& [type, count] : {std::pair{"IFCBUILDINGSTOREY", 2},
                                    {"IFCWALL", 4},
                                    {"IFCOPENINGELEMENT", 3},
                                    {"IFCDOOR", 1},
                                    {"IFCWINDOW", 1},
                                    {"IFCSLAB", 2},
                                    {"IFCSPACE", 2},
                                    {"IFCANNOTATION", 3},
                                    {"IFCBUILDINGELEMENTPROXY", 3},
                                    // The passage stays open.
                                    {"IFCRELFILLSELEMENT", 2}}) {
    EXPECT_EQ(CountMatching(entities, type), count) << type;
  }
  EXPECT_THAT(text, HasSubstr("'slcmap_Wall'"));
  EXPECT_THAT(text, HasSubstr("'thickness_assumed',$,IFCBOOLEAN(.T.)"));
  EXPECT_THAT(text, HasSubstr("'coverage',$,IFCNORMALISEDRATIOMEASURE(0.9)"));
  // Storeys are at their floors, -0.5 m and 3 m, over the lowest.
  EXPECT_THAT(text, HasSubstr("$,$,.ELEMENT.,0.);"));
  EXPECT_THAT(text, HasSubstr("$,$,.ELEMENT.,3.5);"));
  // Coordinates survive a tenth of a millimetre; heights are over the floor of the storey, 3 m.
  MapResult map = testing::MakeTwoStoreys();
  map.lines[2].end_world = {-123.45678, 0.00012, 4.2345};
  EXPECT_THAT(Write(map), HasSubstr("IFCCARTESIANPOINT((-123.45678,0.00012,1.2345))"));
}

TEST_F(IfcWriterTest, NamesThatPeopleGaveAreLongNames) {
  MapResult map = testing::MakeTwoStoreys();
  map.building.name = "House A";
  map.building.storeys[1].name = "First floor";
  map.building.rooms[0].name = "Lab";
  map.building.walls[0].openings[0].name = "D-01";
  const std::string text = Write(map);
  EXPECT_THAT(testing::FindIfcFaults(text), IsEmpty());
  EXPECT_THAT(text, HasSubstr("$,'House A',.ELEMENT."));
  EXPECT_THAT(text, HasSubstr("$,'First floor',.ELEMENT.,3.5);"));
  EXPECT_THAT(text, HasSubstr("'Lab',.ELEMENT.,.INTERNAL."));
  EXPECT_THAT(text, HasSubstr("'Room 1'"));
  EXPECT_THAT(text, HasSubstr("'D-01'"));
}

TEST_F(IfcWriterTest, AnEmptyMapIsAFileTooAndLinesNeedNoStorey) {
  EXPECT_THAT(testing::FindIfcFaults(Write({})), IsEmpty());
  MapResult map = testing::MakeTwoStoreys();
  map.building = {};
  const std::string text = Write(map);
  EXPECT_THAT(testing::FindIfcFaults(text), IsEmpty());
  EXPECT_EQ(CountMatching(testing::ParseStep(text), "IFCANNOTATION"), 3);
}

// A map's lines can be told in the file: a value a line, in the order of the curves.
TEST_F(IfcWriterTest, EachLineHasItsIdKindAndSigma) {
  MapResult map = testing::MakeTwoStoreys();
  map.lines.push_back(map.lines[0]);
  map.lines[3].id = 7;
  map.lines[3].kind = LineKind::kPipe;
  map.lines[3].sigma_m = 0.0055;
  map.lines[3].end_world.x() = 6;
  map.lines[0].kind = LineKind::kEdge;
  const std::string text = Write(map, true);
  EXPECT_THAT(testing::FindIfcFaults(text), IsEmpty());
  const StepEntities entities = testing::ParseStep(text);
  std::vector<std::string> sets;
  for (const auto& [reference, entity] : entities) {
    if (entity.type != "IFCPROPERTYSET" || entity.attributes[2] != "'slcmap_Lines'") continue;
    std::string set;
    for (const std::string& property : testing::ReferencesIn(entity.attributes[4])) {
      const StepEntity& value = entities.at(property);
      if (value.type == "IFCPROPERTYLISTVALUE") set += value.attributes[0] + value.attributes[2];
    }
    sets.push_back(set);
  }
  EXPECT_EQ(sets.size(), 6u);  // of annotations and of bars
  const std::string expected =
      "'ids'(IFCINTEGER(0),IFCINTEGER(7))'kinds'(IFCLABEL('edge'),IFCLABEL('pipe'))"
      "'sigmas_m'(IFCLENGTHMEASURE(0.002),IFCLENGTHMEASURE(0.0055))";
  EXPECT_EQ(std::ranges::count(sets, expected), 2);
  // The second curve of its set is the one that ends at 6 m.
  for (const auto& [reference, entity] : entities) {
    if (entity.type != "IFCGEOMETRICCURVESET") continue;
    const std::vector<std::string> curves = testing::ReferencesIn(entity.attributes[0]);
    if (curves.size() != 2) continue;
    const auto points = testing::ReferencesIn(entities.at(curves[1]).attributes[0]);
    EXPECT_THAT(entities.at(points[1]).attributes[0], HasSubstr("(6.,"));
  }
}

// One on each storey.
MapResult WithPipes(MapResult map) {
  MapPipe pipe;
  pipe.start_world = {1, 2, 0.25};
  pipe.end_world = {1, 2, 2.25};
  pipe.radius_m = 0.06;
  pipe.radius_sigma_m = 0.0012;
  pipe.images = 30;
  map.pipes = {pipe, pipe};
  map.pipes[1].id = 1;
  map.pipes[1].start_world = {1, 2, 4};
  map.pipes[1].end_world = {3, 2, 5};
  return map;
}

TEST_F(IfcWriterTest, PipesAreSegmentsWithTheirRadius) {
  const std::string text = Write(WithPipes(testing::MakeTwoStoreys()));
  EXPECT_THAT(testing::FindIfcFaults(text), IsEmpty());
  EXPECT_EQ(CountMatching(testing::ParseStep(text), "IFCPIPESEGMENT"), 2);
  EXPECT_THAT(text, HasSubstr("'slcmap_Pipe'"));
  EXPECT_THAT(text, HasSubstr("'radius_m',$,IFCLENGTHMEASURE(0.06)"));
  EXPECT_THAT(text, HasSubstr("'radius_sigma_m',$,IFCLENGTHMEASURE(0.0012)"));
  EXPECT_THAT(text, HasSubstr("'images',$,IFCINTEGER(30)"));
}

TEST_F(IfcWriterTest, TheSameMapGivesTheSameBytesAndOthersKeepTheirIdentities) {
  MapResult map = testing::MakeTwoStoreys();
  const std::string text = Write(map);
  EXPECT_EQ(Write(map), text);
  const auto guid_of_wall = [](const std::string& of, const std::string& name) {
    for (const auto& [reference, entity] : testing::ParseStep(of)) {
      if (entity.type == "IFCWALL" && entity.attributes[2] == name) return entity.attributes[0];
    }
    return std::string();
  };
  map.building.walls[0].end.x() -= 0.001;
  map.building.walls.insert(map.building.walls.begin(), map.building.walls[1]);
  const std::string changed = Write(map);
  EXPECT_THAT(testing::FindIfcFaults(changed), IsEmpty());  // two walls that are alike
  EXPECT_NE(guid_of_wall(changed, "'Wall 0'"), guid_of_wall(text, "'Wall 0'"));
  EXPECT_EQ(guid_of_wall(changed, "'Wall 3'"), guid_of_wall(text, "'Wall 3'"));
}

TEST_F(IfcWriterTest, WhatHasNoExtentIsLeftOut) {
  MapResult map = testing::MakeTwoStoreys();
  map.building.walls[1].end = map.building.walls[1].start;
  map.building.walls[0].openings[0].from_m = 9;  // beyond the wall
  map.building.walls[0].openings[0].to_m = 10;
  map.building.rooms[1].polygon = {};
  map.lines[0].end_world = map.lines[0].start_world;
  const std::string text = Write(map, true);
  EXPECT_THAT(testing::FindIfcFaults(text), IsEmpty());
  const StepEntities entities = testing::ParseStep(text);
  EXPECT_EQ(CountMatching(entities, "IFCWALL"), 3);
  EXPECT_EQ(CountMatching(entities, "IFCOPENINGELEMENT"), 2);
  EXPECT_EQ(CountMatching(entities, "IFCSPACE"), 1);
  EXPECT_EQ(CountMatching(entities, "IFCANNOTATION"), 2);
}

TEST_F(IfcWriterTest, NumbersThatAreNotFiniteAreErrors) {
  MapResult map = testing::MakeTwoStoreys();
  map.building.walls[3].sigma_m = std::numeric_limits<double>::infinity();
  EXPECT_THROW(Write(map), DataError);
}

// Ways to break a file, each of which the rules must find.
TEST_F(IfcWriterTest, TheRulesFindWhatIsBroken) {
  const std::string text = Write(testing::MakeTwoStoreys());
  const auto is_found = [&](const std::string& from, const std::string& to) {
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    std::string broken = text;
    return !testing::FindIfcFaults(broken.replace(at, from.size(), to)).empty();
  };
  for (const auto& [what, from, to] :
       {std::tuple{"an attribute less", ",$,.OPENING.);", ",.OPENING.);"},
        {"an attribute more", ".NOTDEFINED.);", ".NOTDEFINED.,$);"},
        {"a mandatory one unset", "IFCPOLYLINE((", "IFCPOLYLINE($);\n#9999=IFCPOLYLINE(("},
        {"a derived one set", "IFCSIUNIT(*,.LENGTHUNIT.", "IFCSIUNIT($,.LENGTHUNIT."},
        {"a reference to nothing", "IFCUNITASSIGNMENT((#", "IFCUNITASSIGNMENT((#9999,#"},
        {"a context of another name", "'Axis','Curve2D'", "'Body','Curve2D'"},
        {"an element in no storey", "IFCRELCONTAINEDINSPATIALSTRUCTURE(", "IFCRELAGGREGATES("},
        {"a set of the standard's name", "'slcmap_Wall'", "'Pset_Wall'"}}) {
    EXPECT_TRUE(is_found(from, to)) << what;
  }
  const auto guid = [&](const std::string& type) {
    return text.substr(text.find("=" + type + "('") + type.size() + 2, 24);
  };
  EXPECT_TRUE(is_found(guid("IFCWALL"), guid("IFCSITE")));  // a repeated identity
  EXPECT_TRUE(is_found(guid("IFCWALL"), "'4" + guid("IFCWALL").substr(2)));
}

TEST_F(IfcWriterTest, TheSchemaHolds) {
  const std::string checker = testing::SharedData("../ifc/check_ifc.py");
  if (checker.empty()) GTEST_SKIP() << "the schema of IFC4 is not there";
  for (const MapResult& map : {testing::MakeTwoStoreys(), MapResult()}) {
    Write(map, true);
    const testing::ReaderOutput output = testing::RunReader("python3 " + checker + " " + Path());
    EXPECT_EQ(output.status, 0) << output.text;
  }
}

void ExpectVolumesOfWalls(const std::vector<IfcProduct>& walls) {
  const double openings_m2 = 0.9 * 2.05 + 1.5 * 1.2 + 1.5 * 2.7;
  // The first two meet at a corner, behind which both have half of what is 0.24 m by 0.1 m.
  const double corner_m3 = 0.5 * 0.24 * 0.1 * 2.7;
  const double expected_m3[] = {(8 * 2.7 - openings_m2) * 0.24 + corner_m3,
                                6 * 2.7 * 0.1 + corner_m3, 5 * 2.7 * 0.15, 4 * 2.5 * 0.2};
  for (size_t i = 0; i < walls.size(); ++i) {
    EXPECT_NEAR(walls[i].volume_m3, expected_m3[i], 1e-4) << i;
  }
}

void ExpectPlacesOfWalls(const std::vector<IfcProduct>& walls) {
  // The passage at its end leaves the first a shorter one; its face looks to -y, into the room.
  EXPECT_LT((walls[0].low - Eigen::Vector3d(-0.1, 6, -0.5)).norm(), 1e-4);
  EXPECT_LT((walls[0].high - Eigen::Vector3d(6.5, 6.24, 2.2)).norm(), 1e-4);
  const Eigen::Vector2d end = testing::Turned(5, 0, testing::kWingTurn_rad);
  const Eigen::Vector2d behind = testing::Turned(0, 0.15, testing::kWingTurn_rad);
  EXPECT_LT((walls[2].low - Eigen::Vector3d(10 + behind.x(), 0, -0.5)).norm(), 1e-4);
  EXPECT_LT((walls[2].high - Eigen::Vector3d(10 + end.x(), end.y() + behind.y(), 2.2)).norm(),
            1e-4);
  EXPECT_THAT(walls[3].low.z(), DoubleNear(3.0, 1e-4));
}

class IfcReaderTest : public IfcWriterTest {
 protected:
  void SetUp() override {
    if (!testing::HasNodeReader("web-ifc")) GTEST_SKIP() << testing::NodeReaderMissing("web-ifc");
  }
  std::string Read(const MapResult& map, bool line_solids = false) const {
    Write(map, line_solids);
    const testing::ReaderOutput output = testing::RunNodeReader("read_ifc.mjs", Path());
    EXPECT_EQ(output.status, 0) << output.text;
    EXPECT_THAT(output.text, Not(HasSubstr("[error]")));
    EXPECT_THAT(output.text, HasSubstr("schema IFC4"));
    return output.text;
  }
};

// Volumes are without openings; walls stand behind their measured faces, from the floor.
TEST_F(IfcReaderTest, WallsHaveTheirVolumesAndPlaces) {
  const std::string text = Read(testing::MakeTwoStoreys());
  const std::vector<IfcProduct> walls = IfcProducts(text, "IfcWall");
  ASSERT_EQ(walls.size(), 4u);
  ExpectVolumesOfWalls(walls);
  ExpectPlacesOfWalls(walls);
  EXPECT_TRUE(IfcProducts(text, "IfcBuildingElementProxy").empty());
  EXPECT_THAT(Read({}), HasSubstr("count IFCPROJECT 1"));  // an empty map
}

TEST_F(IfcReaderTest, SlabsAndSpacesHaveTheirHoles) {
  const std::string text = Read(testing::MakeTwoStoreys());
  const std::vector<IfcProduct> slabs = IfcProducts(text, "IfcSlab");
  ASSERT_EQ(slabs.size(), 2u);
  for (const IfcProduct& slab : slabs) EXPECT_NEAR(slab.volume_m3, 47 * 0.2, 1e-3);
  EXPECT_NEAR(slabs[0].high.z(), -0.5, 1e-4);
  EXPECT_NEAR(slabs[1].low.z(), 2.2, 1e-4);
  const std::vector<IfcProduct> spaces = IfcProducts(text, "IfcSpace");
  ASSERT_EQ(spaces.size(), 1u);  // the other has no height
  EXPECT_NEAR(spaces[0].volume_m3, 47 * 2.7, 1e-3);
}

// 0.3 m between a ceiling and the floor above: less than two slabs of 0.2 m.
TEST_F(IfcReaderTest, SlabsDoNotOverlapThoseOfTheNextStorey) {
  MapResult map = testing::MakeTwoStoreys();
  map.building.storeys[1].floor_m = map.building.rooms[1].floor_m = 2.5;
  map.building.planes.push_back(
      testing::MakeLevelPlane(2, map.building.rooms[1], PlaneKind::kFloor, 2.5));
  const std::vector<IfcProduct> slabs = IfcProducts(Read(map), "IfcSlab");
  ASSERT_EQ(slabs.size(), 3u);
  EXPECT_NEAR(slabs[0].low.z(), -0.7, 1e-4);
  EXPECT_NEAR(slabs[1].high.z(), 2.35, 1e-4);
  EXPECT_NEAR(slabs[2].low.z(), 2.35, 1e-4);
  EXPECT_NEAR(slabs[2].high.z(), 2.5, 1e-4);
}

// The corners of a room: each wall's back ends where the next one's begins.
TEST_F(IfcReaderTest, WallsThatMeetLeaveNoGapAtTheirCorner) {
  MapResult map;
  map.building = testing::MakeBuilding();
  for (PlanWall& wall : map.building.walls) wall.openings.clear();
  double volume_m3 = 0;
  for (const IfcProduct& wall : IfcProducts(Read(map), "IfcWall")) volume_m3 += wall.volume_m3;
  EXPECT_NEAR(volume_m3, (4.4 * 3.4 - 4 * 3) * 2.5, 1e-4);
}

TEST_F(IfcReaderTest, LinesAreSolidsOnRequest) {
  const MapResult map = testing::MakeTwoStoreys();
  const std::vector<IfcProduct> bars = IfcProducts(Read(map, true), "IfcBuildingElementProxy");
  ASSERT_EQ(bars.size(), 3u);
  EXPECT_NEAR(bars[0].volume_m3, 8 * 4e-4, 1e-6);
  EXPECT_NEAR(bars[1].volume_m3, 2.7 * 4e-4, 1e-6);
  const Eigen::Vector3d tilted = map.lines[2].end_world - map.lines[2].start_world;
  EXPECT_NEAR(bars[2].volume_m3, tilted.norm() * 4e-4, 1e-6);
}

TEST_F(IfcReaderTest, PipesAreRoundSolids) {
  const std::vector<IfcProduct> pipes =
      IfcProducts(Read(WithPipes(testing::MakeTwoStoreys())), "IfcPipeSegment");
  ASSERT_EQ(pipes.size(), 2u);
  constexpr double kFacets = 0.1;  // of the volume, which the reader makes of plane pieces
  const double section_m2 = M_PI * 0.06 * 0.06;
  EXPECT_NEAR(pipes[0].volume_m3, 2 * section_m2, kFacets * 2 * section_m2);
  EXPECT_NEAR(pipes[0].low.z(), 0.25, 1e-4);
  EXPECT_NEAR(pipes[0].high.z(), 2.25, 1e-4);
  EXPECT_NEAR(pipes[0].high.x() - pipes[0].low.x(), 0.12, 0.005);
  EXPECT_NEAR(pipes[1].volume_m3, std::sqrt(5) * section_m2, kFacets * 3 * section_m2);
}

}  // namespace
}  // namespace slcmap
