#include "data/external/external_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "data/core/error.h"
#include "tests/testing/reader_program.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;
using testing::MessageOf;
using testing::TempFolder;

TEST(ExternalLines, AreReadFromWhatOthersWrite) {
  const TempFolder folder;
  const std::string rows = "1 2 3 4 5 6.5";
  const std::string files[] = {
      folder.Write("a.obj", "# lines\nv 1 2 3\nv 4 5 6.5\nl 1 2\n"),
      folder.Write("b.obj", "v 1 2 3\nv 4 5 6.5\nl -2 -1\n"),
      folder.Write("limap/finaltracks/track_0.txt", rows + " \n2 2\nimage_id_list 0 1 \n"),
      folder.Write("alltracks.txt", "1\n0 2 2\n1 2 3\n4 5 6.5\n0 1 \n3 4 \n"),
      folder.Write("unseen/alltracks.txt", "1\n0 0 0\n1 2 3\n4 5 6.5\n\n\n"),
      folder.Write("line3d.txt", "1 " + rows + " 2 0 5 1.0 2.0 3.0 4.0 1 7 1.5 2.0 3.0 4.5 \n"),
      folder.Write("segments.txt", rows + "\n"),
      folder.Write("segments.csv", "x1,y1,z1,x2,y2,z2\n1,2,3,4,5,6.5\n"),
      folder.Write("marker.txt",
                   "header: \n  seq: 1\nscale: \n  x: 0.03\n  y: 0.03\n  z: 0.03\npoints: \n  - \n"
                   "    x: 1.0\n    y: 2.0\n    z: 3.0\n  - \n    x: 4.0\n    y: 5.0\n    z: 6.5\n"
                   "colors: []\ntext: ''\n---\n"),
      folder.Write(
          "ros2.txt",
          "scale:\n  x: 0.03\n  y: 0.03\n  z: 0.03\npoints:\n- x: 1.0\n  y: 2.0\n  z: 3.0\n"
          "- x: 4.0\n  y: 5.0\n  z: 6.5\ncolors: []\n---\n"),
      folder.Write("a.dxf",
                   "0\nSECTION\n2\nENTITIES\n0\nLINE\n8\n0\n10\n1\n20\n2\n30\n3\n11\n4\n21\n5\n31\n"
                   "6.5\n0\nENDSEC\n0\nEOF\n"),
      folder.Write(
          "mm.dxf",
          "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n"
          "0\nPOLYLINE\n70\n8\n0\nVERTEX\n10\n1000\n20\n2000\n30\n3000\n0\nVERTEX\n10\n4000\n"
          "20\n5000\n30\n6500\n0\nSEQEND\n0\nENDSEC\n0\nEOF\n"),
      folder.Write("a.ply",
                   "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
                   "property float z\nelement edge 1\nproperty int vertex1\nproperty int vertex2\n"
                   "end_header\n1 2 3\n4 5 6.5\n0 1\n")};
  for (std::string file : files) {
    if (file.find("finaltracks") != std::string::npos) file = folder.Path("limap");
    const ExternalMap map = ReadExternalMap(file);
    ASSERT_EQ(map.lines.size(), 1u) << file;
    EXPECT_LT((map.lines[0].start_world - Vector3d(1, 2, 3)).norm(), 1e-9) << file;
    EXPECT_LT((map.lines[0].end_world - Vector3d(4, 5, 6.5)).norm(), 1e-9) << file;
    EXPECT_TRUE(map.points.empty() && map.triangles.empty()) << file;
  }
}

// A LAS 1.2 file of a point, by the letter of its specification.
std::string Las(uint8_t format, uint32_t points, uint8_t kind = 0) {
  std::string bytes(227, '\0');
  const auto put = [&](size_t at, auto value) { std::memcpy(&bytes[at], &value, sizeof value); };
  bytes.replace(0, 4, "LASF");
  bytes[24] = 1, bytes[25] = 2;
  put(94, uint16_t{227}), put(96, uint32_t{227});
  put(104, format), put(105, uint16_t{20}), put(107, points);
  for (const size_t axis : {0, 1, 2}) {
    put(131 + 8 * axis, 0.001), put(155 + 8 * axis, 400000.0);
  }
  std::string record(20, '\0');
  for (const int32_t axis : {0, 1, 2}) {
    const int32_t value = 1000 * (axis + 1);
    std::memcpy(&record[static_cast<size_t>(4 * axis)], &value, 4);
  }
  record[15] = static_cast<char>(kind);
  return bytes + record;
}

// Groups of an entity of the section ENTITIES.
std::string DxfOf(const std::string& groups) {
  std::string text = "0 SECTION 2 ENTITIES " + groups + " 0 ENDSEC 0 EOF ";
  std::ranges::replace(text, ' ', '\n');
  return text;
}

// Round walls, as pieces of a circle of 2 m about 5, 3.
TEST(ExternalLines, ArcsOfDxfAreDrawnAsTheyAre) {
  const TempFolder folder;
  const std::string arc = "10 5 20 3 40 2 50 350 51 80";
  const std::pair<std::string, double> kRound[] = {
      {"0 ARC 8 0 " + arc, M_PI},
      {"0 CIRCLE 8 0 10 5 20 3 40 2", 4 * M_PI},
      {"0 LWPOLYLINE 8 0 90 2 70 0 10 7 20 3 42 1 10 3 20 3", 2 * M_PI},
      {"0 LWPOLYLINE 8 0 90 2 70 1 10 3 20 3 42 1 10 7 20 3 42 1", 4 * M_PI},
      {"0 LWPOLYLINE 8 0 230 -1 10 -7 20 3 42 -1 10 -3 20 3", 2 * M_PI},
      {"0 POLYLINE 8 0 70 0 0 VERTEX 10 7 20 3 42 1 0 VERTEX 10 3 20 3 0 SEQEND", 2 * M_PI}};
  for (const auto& [groups, length_m] : kRound) {
    SCOPED_TRACE(groups);
    double sum_m = 0;
    for (const PlySegment& s : ReadExternalMap(folder.Write("a.dxf", DxfOf(groups))).lines) {
      EXPECT_NEAR((s.start_world - Vector3d(5, 3, 0)).norm(), 2, 1e-9);
      EXPECT_NEAR((s.end_world - Vector3d(5, 3, 0)).norm(), 2, 1e-9);
      sum_m += (s.end_world - s.start_world).norm();
    }
    EXPECT_NEAR(sum_m, length_m, 0.02);
  }
}

// Of our own exports the trajectory, marks and outlines of planes; a layer of others may be called
// like these.
TEST(ExternalLines, AreThoseOfTheBuildingAlone) {
  const TempFolder folder;
  std::string obj, dxf;
  int first = 1;
  for (const char* name : {"S0_X_EDGE", "S0_X_MARK", "VERTICAL_MARK", "TRAJECTORY", "S0_X_OUTLINE",
                           "S1_FLOOR_PLANE_OUTLINE", "ROOF_OUTLINE"}) {
    obj += std::string("o ") + name + "\nv 0 0 0\nv 1 0 0\nl " + std::to_string(first) + " " +
           std::to_string(first + 1) + "\n";
    dxf += std::string(" 0 LINE 8 ") + name + " 10 0 20 0 30 0 11 1 21 0 31 0";
    first += 2;
  }
  EXPECT_EQ(ReadExternalMap(folder.Write("a.obj", obj)).lines.size(), 2u);
  EXPECT_EQ(ReadExternalMap(folder.Write("a.dxf", DxfOf(dxf.substr(1)))).lines.size(), 2u);
}

TEST(ExternalClouds, TellTheStepsOfTheirCoordinates) {
  const TempFolder folder;
  const auto step = [&](PlyType type, double x) {
    PlyElement vertices{"vertex", {}};
    for (const char* axis : {"x", "y", "z"}) vertices.Add(axis, type);
    vertices.AppendRow({x, 1, 2});
    WritePly(folder.Path("a.ply"), {{}, {vertices}, {}});
    return ReadExternalMap(folder.Path("a.ply")).float_step;
  };
  EXPECT_EQ(step(PlyType::kFloat, 5.4e6), 0.5);
  EXPECT_LT(step(PlyType::kFloat, 54), 1e-5);
  EXPECT_EQ(step(PlyType::kDouble, 5.4e6), 0);
  const std::string head =
      "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nPOINTS 1\nDATA binary\n";
  const float row[] = {5.4e6f, 1, 2};
  const std::string bytes(reinterpret_cast<const char*>(row), sizeof row);
  EXPECT_EQ(ReadExternalMap(folder.Write("a.pcd", head + bytes)).float_step, 0.5);
  // Text may have more digits than its type.
  const std::string text =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nend_header\n5400000.123 1 2\n";
  EXPECT_EQ(ReadExternalMap(folder.Write("b.ply", text)).float_step, 0);
}

TEST(ExternalClouds, AreReadFromWhatOthersWrite) {
  const TempFolder folder;
  const ExternalMap las = ReadExternalMap(folder.Write("a.las", Las(0, 1)));
  ASSERT_EQ(las.points.size(), 1u);
  EXPECT_LT((las.points[0] - Vector3d(400001, 400002, 400003)).norm(), 1e-6);
  const std::string head =
      "# .PCD v0.7\nVERSION 0.7\nFIELDS intensity x y z\nSIZE 1 4 4 4\nTYPE U F F F\n"
      "COUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\n";
  const ExternalMap ascii =
      ReadExternalMap(folder.Write("a.pcd", head + "DATA ascii\n7 1 2 3\n9 nan nan nan\n"));
  ASSERT_EQ(ascii.points.size(), 1u);
  EXPECT_EQ(ascii.left_out, 1);
  EXPECT_EQ(ascii.points[0], Vector3d(1, 2, 3));
  const ExternalMap text = ReadExternalMap(folder.Write("a.xyz", "1 2 3 255 0 17\n4 5 6 1 2 3\n"));
  EXPECT_EQ(text.points.size(), 2u);
  // Six columns: with colours to 1, with normals of which some are missing, and edges of whole
  // metres.
  for (const char* rows : {"1 2 3 0.5 0 1\n4 5 6 0.1 0.2 0.3\n", "1 2 3 0 0 -1\n4 5 6 0 0 0\n"}) {
    EXPECT_EQ(ReadExternalMap(folder.Write("b.xyz", rows)).points.size(), 2u) << rows;
  }
  EXPECT_EQ(ReadExternalMap(folder.Write("c.txt", "0 0 0 6 0 0\n6 0 0 6 4 0\n")).lines.size(), 2u);
  const ExternalMap both = ReadExternalMap(
      folder.Write("both.ply",
                   "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float "
                   "y\nproperty float z\n"
                   "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n"
                   "1 2 3\n7 7 7\n4 5 6.5\n8 8 8\n0 2\n"));
  EXPECT_EQ(both.lines.size(), 1u);
  EXPECT_EQ(both.points.size(), 2u);
  const ExternalMap mesh =
      ReadExternalMap(folder.Write("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1/1 2/2 3 4\n"));
  EXPECT_EQ(mesh.triangles.size(), 2u);
}

// With open3d and ezdxf, which share nothing with our readers.
TEST(ExternalMaps, AreReadFromWhatLibrariesWrite) {
  const std::string python = "/usr/bin/python3";
  int status = 0;
  testing::OutputOf(python + " -c 'import open3d, ezdxf'", &status);
  if (status != 0) GTEST_SKIP() << "open3d or ezdxf is not here: tests/install_readers.sh";
  const TempFolder folder;
  testing::OutputOf(python + " " SLCMAP_SOURCE_DIR "/tests/data/external/write_maps.py " +
                    folder.Path());
  for (const char* name : {"a.ply", "ascii.ply", "a.pcd", "ascii.pcd", "packed.pcd"}) {
    const ExternalMap map = ReadExternalMap(folder.Path(name));
    ASSERT_EQ(map.points.size(), 5000u) << name;
    for (int i : {0, 17, 4999}) {
      const Vector3d expected(0.001 * i, std::sin(0.1 * i), i % 7);
      EXPECT_LT((map.points[static_cast<size_t>(i)] - expected).norm(), 1e-5) << name;
    }
  }
  for (const char* name : {"lines.ply", "metres.dxf", "feet.dxf"}) {
    const ExternalMap map = ReadExternalMap(folder.Path(name));
    ASSERT_EQ(map.lines.size(), 2u) << name;
    EXPECT_LT((map.lines[1].end_world - Vector3d(4, 5, 6.5)).norm(), 1e-6) << name;
  }
  for (const char* name : {"mesh.ply", "mesh.obj"}) {
    EXPECT_EQ(ReadExternalMap(folder.Path(name)).triangles.size(), 12u) << name;
  }
}

TEST(ExternalMaps, ThatCannotBeReadAreRefusedWithTheRemedy) {
  const TempFolder folder;
  const auto refusal = [&](const std::string& name, const std::string& bytes) {
    const std::string path = bytes.empty() ? folder.Path(name) : folder.Write(name, bytes);
    return MessageOf<DataError>([&] { ReadExternalMap(path); });
  };
  const auto expect = [&](const std::string& name, const std::string& bytes,
                          const std::string& words) {
    EXPECT_NE(refusal(name, bytes).find(words), std::string::npos) << refusal(name, bytes);
  };
  expect("a.laz", Las(0x83, 1), "laszip");
  expect("short.las", Las(0, 2), "cut short");
  expect("none.las", Las(0, 0), "no points");
  expect("noise.las", Las(0, 1, 7), "no points");
  expect("a.drc", "DRACO\x02\x02", "draco_decoder");
  expect("a.ply.gz", "\x1f\x8b\x08", "gunzip");
  expect("a.e57", "ASTM-E57xxx", "CloudCompare");
  expect("nothing.ply", "", "found nothing");
  expect("points.ply",
         "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
         "property float z\nend_header\n",
         "without vertices");
  expect("cut.pcd",
         "# .PCD v0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nPOINTS 2\n"
         "DATA binary\nabcd",
         "cut short");
  expect("bad.pcd",
         std::string("# .PCD v0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nPOINTS 1\n"
                     "DATA binary_compressed\n\x04\0\0\0\x0c\0\0\0\xff\xff\xff\xff",
                     104),
         "damaged");
  expect("empty.dxf", "0\nSECTION\n2\nENTITIES\n0\nENDSEC\n0\nEOF\n", "no lines");
  expect("a.obj", "v 0 0 0\nl 1 2\n", "row 2");
  expect("cut.txt", "2\n0 2 2\n1 2 3\n4 5 6.5\n0 1 \n3 4 \n", "found 1 tracks");
  expect("words.txt", "1 2 3\nhello\n", "row 2: found 'hello'");
  expect("folder/readme.md", "x", "expected");
}

}  // namespace
}  // namespace slcmap
