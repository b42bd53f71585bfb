// SVG and PDF plans, as other programs read them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "data/io/file.h"
#include "export/plan/plan_writer.h"
#include "export/plan/sheet.h"
#include "tests/testing/made_building.h"
#include "tests/testing/reader_program.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::OutputOf;

class PlanFilesTest : public ::testing::Test {
 protected:
  PlanFilesTest() {
    map_.complete = true;
    map_.building = testing::MakeBuilding(2);
  }

  std::string WritePdf(const MapResult& map, const PlanOptions& options = {}) const {
    return PdfPlanWriter(options).Write(temp_.Path(""), map, {}).at(0);
  }
  std::vector<std::string> WriteSvg(const MapResult& map) const {
    return SvgPlanWriter(PlanOptions()).Write(temp_.Path(""), map, {});
  }

  MapResult map_;
  testing::TempFolder temp_;
};

TEST_F(PlanFilesTest, ASheetAStorey) {
  const std::vector<std::string> paths = WriteSvg(map_);
  ASSERT_EQ(paths.size(), 2u);
  EXPECT_EQ(std::filesystem::path(paths[1]).filename(), "storey_1.svg");
  EXPECT_THAT(ReadFile(paths[1]), HasSubstr(">Storey 1</text>"));
  EXPECT_THAT(ReadFile(paths[1]), HasSubstr(">Room 2</text>"));
}

TEST_F(PlanFilesTest, AMapWithoutStoreysSaysSo) {
  const std::vector<std::string> paths = WriteSvg(MapResult());
  ASSERT_EQ(paths.size(), 1u);
  EXPECT_EQ(std::filesystem::path(paths[0]).filename(), "no_storey.svg");
  EXPECT_THAT(ReadFile(paths[0]), HasSubstr("This map holds no storey"));
}

TEST_F(PlanFilesTest, AStoreyWithoutWallsIsDrawn) {
  map_.building.walls.clear();
  map_.building.rooms.clear();
  ASSERT_EQ(WriteSvg(map_).size(), 2u);
  EXPECT_THAT(ReadFile(WriteSvg(map_).at(1)), HasSubstr("No wall was found on this storey."));
  EXPECT_GT(ReadFile(WritePdf(map_)).size(), 1000u);
}

TEST_F(PlanFilesTest, SheetsAreToScale) {
  const std::string svg = ReadFile(WriteSvg(map_).at(0));
  EXPECT_THAT(svg, HasSubstr("width=\"297mm\" height=\"210mm\" viewBox=\"0 0 297 210\""));
  EXPECT_THAT(svg, HasSubstr("@page { size: 297mm 210mm; margin: 0 }"));
  // The side of 3.000 m at 1:50.
  EXPECT_THAT(svg, HasSubstr("<path d=\"M188.5000 60.0000L188.5000 120.0000\"/>"));
}

TEST_F(PlanFilesTest, TheSameMapGivesTheSameBytes) {
  const std::string pdf = ReadFile(WritePdf(map_)), svg = ReadFile(WriteSvg(map_).at(0));
  EXPECT_EQ(OutputOf("sleep 1.1"), "");  // a date within would be another one
  EXPECT_TRUE(ReadFile(WritePdf(map_)) == pdf);
  EXPECT_TRUE(ReadFile(WriteSvg(map_).at(0)) == svg);
}

TEST_F(PlanFilesTest, TheTitleBlockSaysWhatAndWhen) {
  map_.id = "0123456789abcdef";
  map_.source.sequence = "/recordings/town hall/mav0";
  map_.trajectory.push_back({1403636579763555584, {}});
  const std::string svg = ReadFile(WriteSvg(map_).at(1));
  EXPECT_THAT(svg, HasSubstr("<title>town hall, Storey 1</title>"));
  EXPECT_THAT(svg, HasSubstr(">town hall, 2014-06-24<"));
  EXPECT_THAT(svg, HasSubstr("drawing 01234567-S1<"));
  EXPECT_THAT(svg, HasSubstr(">Building north: up on this sheet, along<"));
  PlanOptions options;
  options.project = "Annexe";
  options.date = "May 2026";
  options.number = "A-12";
  options.north_deg = 30;
  const std::string given = ReadFile(SvgPlanWriter(options).Write(temp_.Path(""), map_, {}).at(0));
  EXPECT_THAT(given, HasSubstr(">Annexe, May 2026<"));
  EXPECT_THAT(given, HasSubstr("drawing A-12-S0<"));
  EXPECT_THAT(given, HasSubstr("North: 30\u00b0 clockwise"));
}

TEST_F(PlanFilesTest, AllThatTheTitleBlockSaysIsWithinTheFrame) {
  map_.id = "0123456789abcdef";
  map_.complete = false;
  map_.source.world_offset_m = {451200, 5411300, 312};
  const std::vector<DrawnText> texts = MakeSheets(map_, {}).at(0).drawing.texts;
  EXPECT_TRUE(std::ranges::any_of(
      texts, [](const DrawnText& text) { return text.text.ends_with("Map 0123456789abcdef"); }));
  for (const DrawnText& text : texts) {
    EXPECT_GT(text.position.y(), kSheetBorder_mm + 1) << text.text;
  }
}

TEST_F(PlanFilesTest, StampsFromAStartOfTheirOwnAreNoDate) {
  map_.trajectory.push_back({5000000000, {}});
  EXPECT_THAT(ReadFile(WriteSvg(map_).at(0)), HasSubstr("date not known"));
}

TEST_F(PlanFilesTest, XmllintAcceptsTheSvg) {
  SLCMAP_NEEDS_READER("xmllint");
  EXPECT_EQ(OutputOf("xmllint --noout " + WriteSvg(map_).at(0)), "");
  EXPECT_EQ(OutputOf("xmllint --noout " + WriteSvg(MapResult()).at(0)), "");
}

TEST_F(PlanFilesTest, LibrsvgDrawsTheSvgInItsSize) {
  SLCMAP_NEEDS_READER("rsvg-convert");
  const std::string png = temp_.Path("plan.png");
  OutputOf("rsvg-convert --zoom 1 " + WriteSvg(map_).at(0) + " -o " + png);
  const std::string header = ReadFile(png).substr(16, 8);  // width and height, big endian
  const auto number = [&](size_t at) {
    int value = 0;
    for (size_t i = at; i < at + 4; ++i) value = 256 * value + static_cast<uint8_t>(header[i]);
    return value;
  };
  EXPECT_NEAR(number(0), 297 / 25.4 * 96, 1.5);
  EXPECT_NEAR(number(4), 210 / 25.4 * 96, 1.5);
}

TEST_F(PlanFilesTest, PopplerFindsPagesSizesAndTexts) {
  SLCMAP_NEEDS_READER("pdfinfo");
  const std::string path = WritePdf(map_);
  const std::string info = OutputOf("pdfinfo " + path);
  EXPECT_THAT(info, HasSubstr("Pages:           2"));
  EXPECT_THAT(info, HasSubstr("841.89 x 595.276 pts (A4)"));
  EXPECT_THAT(info, Not(HasSubstr("CreationDate")));
  const std::string text = OutputOf("pdftotext -layout " + path + " -");
  for (const char* expected :
       {"12.00 m\u00b2", "Room 2", "4.00", "3.40", "0.90 x 2.10", "Floor plan 1:50 on A4"}) {
    EXPECT_THAT(text, HasSubstr(expected));
  }
}

TEST_F(PlanFilesTest, ALargeBuildingTakesALargeSheet) {
  SLCMAP_NEEDS_READER("pdfinfo");
  map_.building = Building();
  map_.building.storeys = {{0, 0, {}}};
  testing::AddRoom({0, 0}, {70, 20}, 0.2, 0, &map_.building);
  EXPECT_THAT(OutputOf("pdfinfo " + WritePdf(map_)), HasSubstr("(A1)"));
}

}  // namespace
}  // namespace slcmap
