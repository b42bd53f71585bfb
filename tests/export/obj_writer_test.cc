#include "export/obj_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/file.h"
#include "tests/testing/made_building.h"
#include "tests/testing/reader_program.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::HasSubstr;
using testing::OutputOf;

MapResult MakeFurnishedMap() {
  MapResult map;
  map.building = testing::MakeBuilding();
  BuildingPlane floor;
  floor.kind = PlaneKind::kFloor;
  floor.normal = {0, 0, 1};
  floor.outline_world = {{0, 0, 0}, {4, 0, 0}, {4, 3, 0}, {0, 3, 0}};
  map.building.planes = {floor};
  MapLine line;
  line.axis = LineAxis::kX;
  line.kind = LineKind::kEdge;
  line.start_world = {0.12345, 2, 1};
  line.end_world = {3, 2, 1};
  map.lines = {line};
  map.trajectory = {{0, {}}, {100'000'000, {}}};
  return map;
}

TEST(ObjWriterTest, AnObjectALayer) {
  const testing::TempFolder temp;
  const std::string path = ObjWriter(0.5).Write(temp.Path(""), MakeFurnishedMap(), {}).at(0);
  const std::string text = ReadFile(path);
  EXPECT_THAT(text, HasSubstr("o S0_X_EDGE\nv 0.123450 2.000000 1.000000\n"
                              "v 3.000000 2.000000 1.000000\nl 1 2\n"));
  EXPECT_THAT(text, HasSubstr("o S0_FLOOR_PLANE\n"));
  EXPECT_THAT(text, HasSubstr("l 9 10 11 12 9\n"));  // after two triangles
  EXPECT_THAT(text, HasSubstr("o TRAJECTORY\n"));
}

TEST(ObjWriterTest, AssimpReadsLinesAndFaces) {
  SLCMAP_NEEDS_READER("assimp");
  const testing::TempFolder temp;
  const std::string info =
      OutputOf("assimp info " + ObjWriter(0.5).Write(temp.Path(""), MakeFurnishedMap(), {}).at(0));
  EXPECT_THAT(info, HasSubstr("lines"));
  EXPECT_THAT(info, HasSubstr("triangles"));
  for (const char* name : {"S0_X_EDGE", "S0_FLOOR_PLANE", "S0_FLOOR_PLANE_OUTLINE", "TRAJECTORY"}) {
    EXPECT_THAT(info, HasSubstr(name));
  }
  EXPECT_THAT(info, HasSubstr("Maximum point      (4.000000 3.000000 1.000000)"));
}

TEST(ObjWriterTest, AnEmptyMapHasNoObjects) {
  const testing::TempFolder temp;
  EXPECT_EQ(ReadFile(ObjWriter(0.5).Write(temp.Path(""), MapResult(), {}).at(0)),
            "# slcmap, metres in the world frame, z up\n");
}

}  // namespace
}  // namespace slcmap
