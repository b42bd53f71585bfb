#include "export/cad/obj_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/core/error.h"
#include "data/io/file.h"
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
  EXPECT_THAT(text, HasSubstr("mtllib map.mtl\n"));
  EXPECT_THAT(text, HasSubstr("o S0_X_EDGE\nusemtl lines_x\nv 0.123450 2.000000 1.000000\n"
                              "v 3.000000 2.000000 1.000000\nl 1 2\n"));
  EXPECT_THAT(text, HasSubstr("o S0_FLOOR_PLANE\nusemtl floor\n"));
  EXPECT_THAT(text, HasSubstr("l 9 10\nl 10 11\nl 11 12\nl 12 9\n"));  // after two triangles
  EXPECT_THAT(text, HasSubstr("o TRAJECTORY\nusemtl trajectory\n"));
  EXPECT_THAT(ReadFile(temp.Path("map.mtl")), HasSubstr("newmtl floor\nKd 0."));
}

TEST(ObjWriterTest, UpIsZOrYAndItsCommentSaysWhich) {
  const testing::TempFolder temp;
  const std::string path = temp.Path("map.obj");
  ObjWriter(0.5).Write(temp.Path(""), MakeFurnishedMap(), {});
  EXPECT_THAT(ReadFile(path), HasSubstr("metres, z up"));
  ObjWriter(0.5, {.up = "y"}).Write(temp.Path(""), MakeFurnishedMap(), {});
  EXPECT_THAT(ReadFile(path), HasSubstr("metres, y up"));
  EXPECT_THAT(ReadFile(path), HasSubstr("v 0.123450 1.000000 -2.000000\n"));
  EXPECT_THROW(ObjWriter(0.5, {.up = "x"}).Write(temp.Path(""), {}, {}), ConfigError);
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
  EXPECT_THAT(ReadFile(ObjWriter(0.5).Write(temp.Path(""), MapResult(), {}).at(0)),
              ::testing::Not(HasSubstr("\no ")));
}

}  // namespace
}  // namespace slcmap
