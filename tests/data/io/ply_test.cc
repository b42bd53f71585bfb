#include "data/io/ply.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <tuple>

#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/map_line.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const testing::TempFolder kFolder;
const std::string kPath = kFolder.Path("a.ply");

TEST(Ply, ComesBackAsItWasWritten) {
  PlyElement vertices{"vertex", {}};
  vertices.Add("x", PlyType::kFloat);
  vertices.Add("red", PlyType::kUint8);
  vertices.Add("id", PlyType::kInt32);
  vertices.Add("t", PlyType::kDouble);
  vertices.AppendRow({0.5, 255, -7, 1.0 / 3});
  vertices.AppendRow({-1.25, 0, 2000000000, 1e300});
  WritePly(kPath, {{"a comment"}, {vertices}, {{0, 1, 0}}});
  const PlyFile file = ReadPly(kPath);
  EXPECT_THAT(file.comments, ElementsAre("a comment"));
  const PlyElement& read = file.Get("vertex", kPath);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(read.properties[i].type, vertices.properties[i].type);
    EXPECT_EQ(read.properties[i].values, vertices.properties[i].values);
  }
}

TEST(Ply, AsciiHoldsTheSame) {
  PlyElement vertices{"vertex", {}};
  for (const char* name : {"x", "y", "z"}) vertices.Add(name, PlyType::kFloat);
  vertices.Add("red", PlyType::kUint8);
  vertices.AppendRow({123.45678, -0.0001, 987.65432, 255});
  vertices.AppendRow({1e-7, 0, -1e6, 7});
  const PlyFile file = {{"a comment"}, {vertices}, {{0, 1, 0}}};
  WritePly(kPath, file, PlyForm::kAscii);
  EXPECT_THAT(ReadFile(kPath), ::testing::StartsWith("ply\nformat ascii 1.0\ncomment a comment\n"));
  EXPECT_THAT(ReadFile(kPath), ::testing::EndsWith("end_header\n123.45678 -0.0001 987.6543 255\n"
                                                   "1e-07 0 -1000000 7\n3 0 1 0\n"));
  const PlyFile ascii = ReadPly(kPath);
  WritePly(kPath, file);
  const PlyFile binary = ReadPly(kPath);
  EXPECT_EQ(ascii.faces, binary.faces);
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t row = 0; row < 2; ++row) {
      EXPECT_EQ(static_cast<float>(ascii.elements[0].properties[i].values[row]),
                static_cast<float>(binary.elements[0].properties[i].values[row]));
    }
  }
}

TEST(Ply, ReadsAsciiFromOtherPrograms) {
  WriteFile(
      kPath,
      "ply\r\nformat ascii 1.0\r\nelement vertex 2\r\nproperty float32 x\r\n"
      "element face 1\r\nproperty list uchar int vertex_indices\r\n"
      "element edge 1\r\nproperty int vertex1\r\nend_header\r\n1.5\r\n-2\r\n3 0 1 0\r\n1\r\n");
  const PlyFile file = ReadPly(kPath);
  EXPECT_THAT(file.Get("vertex", kPath).Get("x", kPath).values, ElementsAre(1.5, -2));
  EXPECT_THAT(file.Get("edge", kPath).Get("vertex1", kPath).values, ElementsAre(1));
  EXPECT_THAT(file.faces, ElementsAre(ElementsAre(0, 1, 0)));
}

TEST(Ply, ReadsBigEndian) {
  using std::string_literals::operator""s;
  WriteFile(kPath,
            "ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty float x\n"
            "property ushort a\nend_header\n\x3f\xc0\x00\x00\x01\x02"s);
  const PlyFile file = ReadPly(kPath);
  EXPECT_THAT(file.Get("vertex", kPath).Get("x", kPath).values, ElementsAre(1.5));
  EXPECT_THAT(file.Get("vertex", kPath).Get("a", kPath).values, ElementsAre(258));
}

TEST(Ply, FacesComeBackAndRefuseVerticesThatCannotBe) {
  PlyElement vertices{"vertex", {{"x", PlyType::kFloat, {1, 2, 3, 4}}}};
  const std::vector<std::vector<int32_t>> faces = {{0, 1, 2}, {0, 1, 2, 3}};
  WritePly(kPath, {{}, {vertices}, faces});
  EXPECT_EQ(ReadPly(kPath).faces, faces);
  WritePly(kPath, {{}, {vertices}, {{0, 1, -2}}});
  EXPECT_THROW(ReadPly(kPath), DataError);
}

TEST(Ply, AllTypesComeBackToTheirLimits) {
  const std::pair<PlyType, std::vector<double>> limits[] = {
      {PlyType::kInt8, {-128, 127}},
      {PlyType::kUint8, {0, 255}},
      {PlyType::kInt16, {-32768, 32767}},
      {PlyType::kUint16, {0, 65535}},
      {PlyType::kInt32, {-2147483648.0, 2147483647}},
      {PlyType::kUint32, {0, 4294967295}}};
  for (const auto& [type, values] : limits) {
    PlyElement element{"vertex", {{"a", type, values}}};
    WritePly(kPath, {{}, {element}, {}});
    EXPECT_EQ(ReadPly(kPath).Get("vertex", kPath).Get("a", kPath).values, values);
    element.properties[0].values[1] += 1;
    EXPECT_THROW(WritePly(kPath, {{}, {element}, {}}), OutputError);
  }
}

TEST(Ply, ElementsWithoutPropertiesAreSkipped) {
  WriteFile(kPath, "ply\nformat ascii 1.0\nelement camera 99999999999999\nend_header\n");
  EXPECT_TRUE(ReadPly(kPath).elements.empty());
}

TEST(Ply, DamageIsNamed) {
  const auto expect_error = [](const std::string& bytes, const std::string& message) {
    WriteFile(kPath, bytes);
    EXPECT_THAT(testing::MessageOf<DataError>([] { ReadPly(kPath); }),
                AllOf(HasSubstr(kPath), HasSubstr(message)));
  };
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nend_header\n";
  expect_error("solid cube\n", "expected a PLY file");
  expect_error("ply\nformat ascii 1.0\n", "no end_header");
  expect_error("ply\nformat binary_middle_endian 1.0\nend_header\n", "binary_middle_endian");
  expect_error("ply\nformat ascii 1.0\nelement vertex two\nend_header\n", "element NAME COUNT");
  expect_error("ply\nformat ascii 1.0\nproperty float x\nend_header\n", "property TYPE NAME");
  expect_error("ply\nformat ascii 1.0\nelement vertex 1\nproperty half x\nend_header\n", "'half'");
  expect_error(head + "1\n", "found 1 rows of element vertex, expected 2");
  expect_error(head + "1\nabc\n", "vertex row 2: found 'abc'");
}

TEST(MapLine, ComesBackFromItsFile) {
  const testing::TempFolder folder;
  const std::string path = folder.Path("lines.ply");
  WriteMapLines(path, {{7, 1, LineAxis::kY, 2, 0.25, true, {1, 2, 3}, {1, 5.5, 3}, 12, 0.5, 0.25},
                       {9, 0, LineAxis::kNone, -1, 0, false, {0, 0, 0}, {1, 1, 1}}});
  const std::vector<MapLine> lines = ReadMapLines(path);
  ASSERT_EQ(lines.size(), 2u);
  const MapLine& first = lines[0];
  EXPECT_EQ(std::tie(first.id, first.segment, first.axis, first.world, first.sigma_m, first.recent),
            std::tuple(7, 1, LineAxis::kY, 2, 0.25, true));
  EXPECT_EQ(std::tie(first.observations, first.deviation_rad, first.deviation_sigma_rad),
            std::tuple(12, 0.5, 0.25));
  EXPECT_EQ(first.end_world, Eigen::Vector3d(1, 5.5, 3));
  EXPECT_EQ(std::tie(lines[1].axis, lines[1].world, lines[1].recent),
            std::tuple(LineAxis::kNone, -1, false));
  // One of which nothing is known across, as runs report it.
  WriteMapLines(path, {{1, 0, LineAxis::kX, 0, 1e9, false, {0, 0, 0}, {1, 0, 0}}});
  EXPECT_EQ(ReadMapLines(path)[0].sigma_m, 1e9);
  WriteMapLines(path, {});
  EXPECT_TRUE(ReadMapLines(path).empty());
  EXPECT_THAT(testing::MessageOf<OutputError>([] { WriteMapLines("/dev/full", {}); }),
              HasSubstr("/dev/full"));
}

TEST(MapLine, VerticesAndEdgesHaveTheColourOfTheAxis) {
  const testing::TempFolder folder;
  const std::string path = folder.Path("lines.ply");
  WriteMapLines(path, {{0, 0, LineAxis::kX, 0, 0, true, {0, 0, 0}, {1, 0, 0}},
                       {1, 0, LineAxis::kX, 0, 0, false, {0, 0, 0}, {1, 0, 0}}});
  const PlyFile file = ReadPly(path);
  const double bright = LineColour(LineAxis::kX, true)[0],
               dark = LineColour(LineAxis::kX, false)[0];
  EXPECT_THAT(file.Get("vertex", path).Get("red", path).values,
              ElementsAre(bright, bright, dark, dark));
  EXPECT_THAT(file.Get("edge", path).Get("red", path).values, ElementsAre(bright, dark));
}

TEST(MapLine, AnyEdgePlyIsRead) {
  const testing::TempFolder folder;
  WriteLinesPly(folder.Path("plain.ply"), {{{0, 0, 0}, {1, 0, 0}}, {{0, 0, 0}, {0, 2, 0}}});
  const std::vector<MapLine> lines = ReadMapLines(folder.Path("plain.ply"));
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[1].id, 1);
  EXPECT_EQ(lines[1].axis, LineAxis::kNone);
  EXPECT_EQ(lines[1].end_world, Eigen::Vector3d(0, 2, 0));
}

TEST(MapLine, ValuesThatCannotBeAreNamed) {
  const testing::TempFolder folder;
  const auto file = [&](const char* property, const char* value) {
    return folder.Write("bad.ply",
                        std::string("ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\n"
                                    "property float y\nproperty float z\nelement edge 1\n"
                                    "property int vertex1\nproperty int vertex2\nproperty float ") +
                            property + "\nend_header\n0 0 0\n1 1 1\n0 1 " + value + "\n");
  };
  const auto expect_error = [&](const char* property, const char* value) {
    EXPECT_THAT(testing::MessageOf<DataError>([&] { ReadMapLines(file(property, value)); }),
                AllOf(HasSubstr("bad.ply: edge row 1"), HasSubstr(property), HasSubstr(value)));
  };
  expect_error("axis", "5");
  expect_error("world", "-2");
  expect_error("sigma_m", "nan");
  EXPECT_EQ(ReadMapLines(file("axis", "2"))[0].axis, LineAxis::kVertical);
}

}  // namespace
}  // namespace slcmap
