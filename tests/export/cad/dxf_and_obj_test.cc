#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <initializer_list>
#include <map>
#include <regex>
#include <sstream>
#include <utility>

#include "data/core/error.h"
#include "data/io/file.h"
#include "export/export.h"
#include "export/scene/formats.h"
#include "tests/testing/made_building.h"
#include "tests/testing/reader_program.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::OutputOf;

const char* const kPython = "/usr/bin/python3";  // that for which Debian has packages

class DxfWriterTest : public ::testing::Test {
 protected:
  DxfWriterTest() { map_.building = testing::MakeBuilding(2, 0.2); }

  void Write(const MapResult& map) const { WriteDxf({}, temp_.Path(""), map); }

  MapResult map_;
  testing::TempFolder temp_;
};

// A wall of 4 m by 2.5 m whose door, of 0.9 m by 2.1 m, reaches down to its border.
BuildingPlane WallWithDoor() {
  BuildingPlane plane;
  plane.kind = PlaneKind::kWall;
  plane.normal = {0, -1, 0};
  plane.outline_world = {{0, 0, 0}, {4, 0, 0}, {4, 0, 2.5}, {0, 0, 2.5}};
  PlaneOpening door;
  door.outline_world = {{1, 0, 0}, {1.9, 0, 0}, {1.9, 0, 2.1}, {1, 0, 2.1}};
  plane.openings = {door};
  return plane;
}

// A pipe along each axis that there is, in both storeys.
std::vector<MapPipe> PipesOfAllAxes() {
  std::vector<MapPipe> pipes;
  for (const double z : {0.0, 3.2}) {
    for (const auto& [axis, end] : std::initializer_list<std::pair<LineAxis, Eigen::Vector3d>>{
             {LineAxis::kX, {3, 0, 0}},
             {LineAxis::kY, {0, 2, 0}},
             {LineAxis::kVertical, {0, 0, 2}},
             {LineAxis::kNone, {1, 1, 0.5}},
             {LineAxis::kSloped, {2, 0, 1}}}) {
      MapPipe pipe;
      pipe.id = std::ssize(pipes);
      pipe.axis = axis;
      pipe.start_world = {1, 1, z + 0.2};
      pipe.end_world = pipe.start_world + end;
      pipe.radius_m = 0.05;
      pipes.push_back(pipe);
    }
  }
  return pipes;
}

TEST_F(DxfWriterTest, NamesAreThoseThatR12Takes) {
  map_.building.storeys[1].id = 123456789;
  map_.building.planes = {WallWithDoor()};
  map_.building.planes[0].storey = 123456789;
  MapLine line;
  line.start_world.z() = line.end_world.z() = 4;
  line.axis = LineAxis::kVertical;
  line.kind = LineKind::kEdge;
  map_.lines = {line};
  map_.building.rooms.at(0).name = "B\u00fcro";
  Write(map_);
  EXPECT_THAT(ReadFile(temp_.Path("plan.dxf")), HasSubstr("B\\U+00FCro"));
  const std::regex layer("\n8\n([^\n]*)\n");
  int count = 0;
  for (const char* name : {"plan.dxf", "map.dxf"}) {
    const std::string text = ReadFile(temp_.Path(name));
    for (std::sregex_iterator it(text.begin(), text.end(), layer), end; it != end; ++it, ++count) {
      EXPECT_TRUE(std::regex_match((*it)[1].str(), std::regex("[A-Z0-9$_-]{1,31}"))) << (*it)[1];
    }
    EXPECT_TRUE(
        std::all_of(text.begin(), text.end(), [](char c) { return c == '\n' || c >= ' '; }));
  }
  EXPECT_GT(count, 50);
  PlanOptions with_sigmas;
  with_sigmas.wall_sigma = true;
  WriteDxf(with_sigmas, temp_.Path(""), map_);
  EXPECT_THAT(ReadFile(temp_.Path("plan.dxf")),
              AllOf(HasSubstr("12.00 m2"), HasSubstr("\nsigma ")));
}

MapLine EdgeAlongX(const Eigen::Vector3d& start, const Eigen::Vector3d& end) {
  MapLine line;
  line.axis = LineAxis::kX;
  line.kind = LineKind::kEdge;
  line.start_world = start;
  line.end_world = end;
  return line;
}

// All that files hold, in two storeys, some of it far from the origin.
MapResult MakeFullMap() {
  MapResult map;
  map.building = testing::MakeBuilding(2, 0.2);
  map.building.planes = {WallWithDoor()};
  map.trajectory = {{0, {}}, {100'000'000, {}}, {5'000'000'000, {}}, {5'100'000'000, {}}};
  map.points.emplace_back().p_world = {1123.45678, -2000.00012, 3.3};
  map.lines = {EdgeAlongX({1000.12341, -1999.01232, 3.5}, {1005, -1995, 3.5})};
  map.pipes = PipesOfAllAxes();
  return map;
}

// What read_dxf.py says of the files of some maps, which it reads at once as it is slow to start.
class EzdxfTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    int status = 0;
    OutputOf(std::string(kPython) + " -c 'import ezdxf'", &status);
    if (status != 0) return;
    MapResult plain, small;
    plain.building = testing::MakeBuilding(2, 0.2);
    plain.building.walls[0].openings.clear();
    small.building = testing::MakeBuilding();
    const testing::TempFolder temp;
    std::string files;
    const auto write = [&](const char* name, const MapResult& map) {
      MakeFolder(temp.Path(name));
      for (const std::string& path : WriteDxf({}, temp.Path(name), map)) {
        files += " " + path.substr(temp.Path().size());
      }
    };
    write("full", MakeFullMap());
    write("plain", plain);
    write("small", small);
    write("empty", {});
    const std::string text =
        OutputOf("cd " + temp.Path("") + " && " + kPython +
                 " " SLCMAP_SOURCE_DIR "/tests/export/cad/read_dxf.py" + files);
    std::istringstream rows(text);
    std::string file;
    for (std::string row; std::getline(rows, row);) {
      if (row.starts_with("FILE ")) {
        file = row.substr(5);
      } else {
        read_[file] += row + "\n";
      }
    }
  }
  static void TearDownTestSuite() { read_.clear(); }

  void SetUp() override {
    if (read_.empty()) GTEST_SKIP() << "ezdxf is not here: tests/install_readers.sh";
  }

  static std::map<std::string, std::string> read_;  // by file
};
std::map<std::string, std::string> EzdxfTest::read_;

// What a program shows at first is the drawing; layers on which nothing is are not there.
TEST_F(EzdxfTest, FindsNothingToMendAndNoEmptyLayer) {
  EXPECT_GE(read_.size(), 10u);
  for (const auto& [file, read] : read_) {
    EXPECT_THAT(read, AllOf(HasSubstr("version AC1009\nerrors 0\nfixes 0\nunits 6"),
                            HasSubstr("empty layers 0\n")))
        << file;
  }
  EXPECT_THAT(read_["small/plan.dxf"],
              AllOf(HasSubstr("view holds the drawing True"),
                    HasSubstr("line scale 0.05")));  // 1:50, dashes in millimetres
}

TEST_F(EzdxfTest, FourMetresAreFourMetres) {
  for (const char* row :
       {"LINE S0_WALL 4.0000", "DIMENSION S0_DIMENSION 4.0000 4.00",
        "DIMENSION S0_DIMENSION 3.0000 3.00", "text height 0.1", /* 2 mm at 1:50 */
        "TEXT S0_ROOM_TEXT 12.00 m2"}) {
    EXPECT_THAT(read_["plain/plan.dxf"], HasSubstr(row));
  }
}

TEST_F(EzdxfTest, TheLowestStoreyIsShownAndEachIsInAFileOfItsOwnToo) {
  EXPECT_THAT(read_["plain/plan.dxf"],
              AllOf(HasSubstr("LAYER S0_WALL on"), HasSubstr("LAYER S1_WALL off"),
                    HasSubstr("TEXT S1_ROOM_TEXT Room 2")));
  EXPECT_THAT(read_["plain/plan/storey_1.dxf"],
              AllOf(HasSubstr("LAYER S1_WALL on"), HasSubstr("TEXT S1_ROOM_TEXT Room 2"),
                    Not(HasSubstr("S0_"))));
  EXPECT_THAT(read_["plain/plan/storey_0.dxf"], Not(HasSubstr("S1_")));
}

TEST_F(EzdxfTest, CoordinatesSurviveAndPlanesAreFacesWithoutTheirOpeningsBesideOutlines) {
  for (const char* rows :
       {"STARTS S1_X_EDGE 1000.1234 -1999.0123 3.5000", "POINT POINTS 1123.4568 -2000.0001 3.3000",
        "3DFACE S0_WALL_PLANE 8.1100",
        "POLYLINE S0_WALL_PLANE_OUTLINE 4 closed\n"
        "POLYLINE S0_WALL_PLANE_OUTLINE 4 closed\n",
        "POLYLINE TRAJECTORY 2 open\nPOLYLINE TRAJECTORY 2 open", "LAYER S0_X_PIPE on",
        "LINE S0_X_PIPE 3.0000", "LINE S0_Y_PIPE 2.0000", "LINE S0_VERTICAL_PIPE 2.0000",
        "LINE S0_OTHER_PIPE 1.5000", "LINE S0_SLOPED_PIPE 2.2361", "LINE S1_VERTICAL_PIPE 2.0000",
        "STARTS S1_SLOPED_PIPE 1.0000 1.0000 3.4000"}) {
    EXPECT_THAT(read_["full/map.dxf"], HasSubstr(rows));
  }
}

TEST_F(DxfWriterTest, FreeCadReadsLayersLinesPointsAndTexts) {
  SLCMAP_NEEDS_READER("freecadcmd");
  map_.building.walls[0].openings.clear();
  map_.points.emplace_back().p_world = {1, 2, 3};
  map_.pipes = PipesOfAllAxes();
  Write(map_);
  const std::string read =
      OutputOf("HOME=" + temp_.Path("") + " SLCMAP_DXF=" + temp_.Path("plan.dxf") + ":" +
               temp_.Path("map.dxf") +
               " timeout 300 freecadcmd " SLCMAP_SOURCE_DIR "/tests/export/cad/read_freecad.py");
  for (const char* row : {"slcmap EDGE 4000.0", "slcmap EDGE 2236.1", "slcmap TEXT 12.00 m2",
                          "slcmap POINT 1000.0 2000.0 3000.0"}) {
    EXPECT_THAT(read, HasSubstr(row));
  }
  EXPECT_THAT(read, Not(HasSubstr("Failed to read")));
}

MapResult MakeFurnishedMap() {
  MapResult map;
  map.building = testing::MakeBuilding();
  BuildingPlane floor;
  floor.kind = PlaneKind::kFloor;
  floor.normal = {0, 0, 1};
  floor.outline_world = {{0, 0, 0}, {4, 0, 0}, {4, 3, 0}, {0, 3, 0}};
  map.building.planes = {floor};
  map.lines = {EdgeAlongX({0.12345, 2, 1}, {3, 2, 1})};
  map.trajectory = {{0, {}}, {100'000'000, {}}};
  return map;
}

TEST(ObjWriterTest, AnObjectALayer) {
  const testing::TempFolder temp;
  const std::string path = WriteObj("z", temp.Path(""), MakeFurnishedMap()).at(0);
  const std::string text = ReadFile(path);
  EXPECT_THAT(text, HasSubstr("mtllib map.mtl\n"));
  EXPECT_THAT(text, HasSubstr("o S0_X_EDGE\nusemtl lines_x\nv 0.123450 2.000000 1.000000\n"
                              "v 3.000000 2.000000 1.000000\nl 1 2\n"));
  EXPECT_THAT(text, HasSubstr("o S0_FLOOR_PLANE\nusemtl floor\n"));
  EXPECT_THAT(text, HasSubstr("l 9 10\nl 10 11\nl 11 12\nl 12 9\n"));  // after two triangles
  EXPECT_THAT(text, HasSubstr("o TRAJECTORY\nusemtl trajectory\n"));
  EXPECT_THAT(ReadFile(temp.Path("map.mtl")), HasSubstr("newmtl floor\nKd 0."));
  EXPECT_THAT(ReadFile(WriteObj("z", temp.Path(""), MapResult()).at(0)), Not(HasSubstr("\no ")));
}

TEST(ObjWriterTest, UpIsZOrYAndItsCommentSaysWhich) {
  const testing::TempFolder temp;
  const std::string path = temp.Path("map.obj");
  WriteObj("z", temp.Path(""), MakeFurnishedMap());
  EXPECT_THAT(ReadFile(path), HasSubstr("metres, z up"));
  WriteObj("y", temp.Path(""), MakeFurnishedMap());
  EXPECT_THAT(ReadFile(path), HasSubstr("metres, y up"));
  EXPECT_THAT(ReadFile(path), HasSubstr("v 0.123450 1.000000 -2.000000\n"));
  ExportOptions sideways;
  sideways.obj_up = "x";
  EXPECT_THROW(CheckFormats(sideways), ConfigError);
}

TEST(ObjWriterTest, AssimpReadsLinesAndFaces) {
  SLCMAP_NEEDS_READER("assimp");
  const testing::TempFolder temp;
  const std::string info =
      OutputOf("assimp info " + WriteObj("z", temp.Path(""), MakeFurnishedMap()).at(0));
  EXPECT_THAT(info, HasSubstr("lines"));
  EXPECT_THAT(info, HasSubstr("triangles"));
  for (const char* name : {"S0_X_EDGE", "S0_FLOOR_PLANE", "S0_FLOOR_PLANE_OUTLINE", "TRAJECTORY"}) {
    EXPECT_THAT(info, HasSubstr(name));
  }
  EXPECT_THAT(info, HasSubstr("Maximum point      (4.000000 3.000000 1.000000)"));
}

}  // namespace
}  // namespace slcmap
