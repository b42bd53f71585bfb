#include "data/io/map_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/core/error.h"
#include "data/io/file.h"
#include "data/io/ply.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

std::vector<int> Parts(const std::array<uint8_t, 3>& colour) {
  return {colour.begin(), colour.end()};
}

TEST(MapLine, ComesBackFromItsFile) {
  const testing::TempFolder folder;
  const std::string path = folder.Path("lines.ply");
  WriteMapLines(path, {{7, 1, LineAxis::kY, 2, 0.25, true, {1, 2, 3}, {1, 5.5, 3}, 12, 0.5, 0.25},
                       {9, 0, LineAxis::kNone, -1, 0, false, {0, 0, 0}, {1, 1, 1}}});
  const std::vector<MapLine> lines = ReadMapLines(path);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0].id, 7);
  EXPECT_EQ(lines[0].segment, 1);
  EXPECT_EQ(lines[0].axis, LineAxis::kY);
  EXPECT_EQ(lines[0].world, 2);
  EXPECT_EQ(lines[0].sigma_m, 0.25);
  EXPECT_TRUE(lines[0].recent);
  EXPECT_EQ(lines[0].observations, 12);
  EXPECT_EQ(lines[0].deviation_rad, 0.5);
  EXPECT_EQ(lines[0].deviation_sigma_rad, 0.25);
  EXPECT_EQ(lines[0].end_world, Eigen::Vector3d(1, 5.5, 3));
  EXPECT_EQ(lines[1].axis, LineAxis::kNone);
  EXPECT_EQ(lines[1].world, -1);
  EXPECT_FALSE(lines[1].recent);
}

TEST(MapLine, OfWhichNothingIsKnownAcrossComesBack) {
  const testing::TempFolder folder;
  MapLine line{1, 0, LineAxis::kX, 0, 1e9, false, {0, 0, 0}, {1, 0, 0}};  // as runs report it
  WriteMapLines(folder.Path("lines.ply"), {line});
  EXPECT_EQ(ReadMapLines(folder.Path("lines.ply"))[0].sigma_m, 1e9);
}

TEST(MapLine, NoLinesMakeAFileWithoutEdges) {
  const testing::TempFolder folder;
  WriteMapLines(folder.Path("lines.ply"), {});
  EXPECT_TRUE(ReadMapLines(folder.Path("lines.ply")).empty());
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

TEST(MapLine, OldLinesAreDarkerThanRecentOnes) {
  for (const LineAxis axis :
       {LineAxis::kX, LineAxis::kY, LineAxis::kVertical, LineAxis::kNone, LineAxis::kSloped}) {
    const std::vector<int> recent = Parts(LineColour(axis, true));
    const std::vector<int> old = Parts(LineColour(axis, false));
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(old[i], 0.8 * recent[i], 0.5);
  }
  EXPECT_GT(LineColour(LineAxis::kX, true)[0], 2 * LineColour(LineAxis::kX, true)[1]);  // red
  EXPECT_GT(LineColour(LineAxis::kY, true)[1], 2 * LineColour(LineAxis::kY, true)[0]);  // green
  EXPECT_GT(LineColour(LineAxis::kVertical, true)[2], 2 * LineColour(LineAxis::kVertical, true)[0]);
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
    const std::string path = file(property, value);
    EXPECT_THAT([&] { ReadMapLines(path); },
                ThrowsMessage<DataError>(AllOf(HasSubstr("bad.ply: edge row 1"),
                                               HasSubstr(property), HasSubstr(value))));
  };
  expect_error("axis", "5");
  expect_error("world", "-2");
  expect_error("sigma_m", "nan");
  EXPECT_EQ(ReadMapLines(file("axis", "2"))[0].axis, LineAxis::kVertical);
}

TEST(MapLine, FullDiskNamesTheFile) {
  EXPECT_THAT([] { WriteMapLines("/dev/full", {}); },
              ThrowsMessage<OutputError>(HasSubstr("/dev/full")));
}

}  // namespace
}  // namespace slcmap
