// SVG and PDF plans, as other programs read them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "data/core/error.h"
#include "data/core/math.h"
#include "data/io/file.h"
#include "export/export.h"
#include "export/plan/sheet.h"
#include "export/scene/formats.h"
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
    return WritePdfPlans(options, temp_.Path(""), map).at(0);
  }
  std::vector<std::string> WriteSvg(const MapResult& map) const {
    return WriteSvgPlans({}, temp_.Path(""), map);
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
  const std::vector<std::string> none = WriteSvg(MapResult());
  ASSERT_EQ(none.size(), 1u);
  EXPECT_EQ(std::filesystem::path(none[0]).filename(), "no_storey.svg");
  EXPECT_THAT(ReadFile(none[0]), HasSubstr("This map holds no storey"));
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
  const std::string given = ReadFile(WriteSvgPlans(options, temp_.Path(""), map_).at(0));
  EXPECT_THAT(given, HasSubstr(">Annexe, May 2026<"));
  EXPECT_THAT(given, HasSubstr("drawing A-12-S0<"));
  EXPECT_THAT(given, HasSubstr("North: 30\u00b0 clockwise"));
  // Stamps from a start of their own are no date.
  map_.trajectory = {{5000000000, {}}};
  EXPECT_THAT(ReadFile(WriteSvg(map_).at(0)), HasSubstr("date not known"));
}

TEST_F(PlanFilesTest, AllThatTheTitleBlockSaysIsWithinTheFrame) {
  map_.id = "0123456789abcdef";
  map_.complete = false;
  map_.source.georeference = Georeference{"", {451200, 5411300, 312}};
  const std::vector<DrawnText> texts = MakeSheets(map_, {}).at(0).drawing.texts;
  EXPECT_TRUE(std::ranges::any_of(
      texts, [](const DrawnText& text) { return text.text.ends_with("Map 0123456789abcdef"); }));
  for (const DrawnText& text : texts) {
    EXPECT_GT(text.position.y(), kSheetBorder_mm + 1) << text.text;
  }
}

TEST_F(PlanFilesTest, TheArrowOfAMapOnEarthPointsToTrueNorth) {
  // 1.92 degrees to the west of the grid's north there.
  map_.source.georeference = Georeference{"EPSG:25832", {691607, 5334760, 515}, 30 * kDegree};
  const std::string svg = ReadFile(WriteSvg(map_).at(0));
  EXPECT_THAT(svg, HasSubstr(">North: 28.08\u00b0 clockwise from up,<"));
  EXPECT_THAT(svg, HasSubstr(">true north, by EPSG:25832<"));
  EXPECT_THAT(svg, HasSubstr(">Origin 691607.00, 5334760.00, 515.00 m, EPSG:25832<"));
  map_.source.georeference->crs = "";
  EXPECT_THAT(ReadFile(WriteSvg(map_).at(0)),
              ::testing::AllOf(HasSubstr(">North: 30\u00b0 clockwise from up,<"),
                               HasSubstr(">that of the grid of control points<")));
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
  // A large building takes a large sheet.
  map_.building = Building();
  map_.building.storeys = {{0, 0, {}}};
  testing::AddRoom({0, 0}, {70, 20}, 0.2, 0, &map_.building);
  EXPECT_THAT(OutputOf("pdfinfo " + WritePdf(map_)), HasSubstr("(A1)"));
}

constexpr double kGridRes_m = 0.1;

// Free space of 2 m by 1 m over a floor at -1 m, a wall of full height along its right side, a step
// of 0.1 m, a lintel at 2 m, and something that is unknown.
MapResult MakeRoomToDriveIn() {
  MapResult map;
  map.building.storeys = {{0, -1, std::nullopt}};
  CellObservation cells;
  const auto fill = [](const Eigen::Vector3i& low, const Eigen::Vector3i& high,
                       std::vector<OctreeCell>* of) {
    for (int x = low.x(); x < high.x(); ++x) {
      for (int y = low.y(); y < high.y(); ++y) {
        for (int z = low.z(); z < high.z(); ++z) of->emplace_back(x, y, z);
      }
    }
  };
  fill({-5, 3, -10}, {15, 13, 10}, &cells.free);
  fill({15, 3, -10}, {16, 13, 14}, &cells.occupied);  // the wall
  fill({0, 5, -10}, {2, 7, -9}, &cells.occupied);     // the step
  fill({8, 3, 10}, {10, 13, 12}, &cells.occupied);    // the lintel
  fill({-5, 20, -5}, {-4, 21, -4}, &cells.occupied);  // a thing beyond what was seen
  map.occupancy.Mark(cells);
  map.occupancy.Finish();
  return map;
}

// As map_server reads it: the value of the cell that holds a point.
class ReadGrid {
 public:
  explicit ReadGrid(const std::string& yaml)
      : yaml_(YAML::LoadFile(yaml)),
        image_(cv::imread(yaml.substr(0, yaml.rfind('/') + 1) + yaml_["image"].as<std::string>(),
                          cv::IMREAD_UNCHANGED)) {}

  int At(double x, double y) const {
    const double resolution_m = yaml_["resolution"].as<double>();
    const int column =
        static_cast<int>(std::floor((x - yaml_["origin"][0].as<double>()) / resolution_m));
    const int row =
        static_cast<int>(std::floor((y - yaml_["origin"][1].as<double>()) / resolution_m));
    return image_.at<uint8_t>(image_.rows - 1 - row, column);
  }
  const YAML::Node& yaml() const { return yaml_; }

 private:
  YAML::Node yaml_;
  cv::Mat image_;
};

TEST(GridWriter, ASecondReaderFindsWallsWhereTheyAre) {
  const testing::TempFolder temp;
  WriteGrids({}, temp.Path(""), MakeRoomToDriveIn());
  const ReadGrid grid(temp.Path("grid/storey_0.yaml"));
  EXPECT_EQ(grid.yaml()["negate"].as<int>(), 0);
  EXPECT_EQ(grid.yaml()["mode"].as<std::string>(), "trinary");
  EXPECT_EQ(grid.yaml()["resolution"].as<double>(), kGridRes_m);
  for (double y = 0.35; y < 1.3; y += kGridRes_m) {
    EXPECT_EQ(grid.At(1.55, y), 0);    // the wall
    EXPECT_EQ(grid.At(1.45, y), 254);  // before it
    EXPECT_EQ(grid.At(0.95, y), 254);  // beneath the lintel
  }
  EXPECT_EQ(grid.At(0.1, 0.6), 254);   // over the step
  EXPECT_EQ(grid.At(-0.45, 2.05), 0);  // the thing is at the top
  EXPECT_EQ(grid.At(1.0, 2.05), 205);
  EXPECT_LT((255 - 254) / 255.0, grid.yaml()["free_thresh"].as<double>());
  EXPECT_GT((255 - 205) / 255.0, grid.yaml()["free_thresh"].as<double>());
  EXPECT_GT(1.0, grid.yaml()["occupied_thresh"].as<double>());
}

TEST(GridWriter, HeightsAreAnOption) {
  const testing::TempFolder temp;
  WriteGrids({.low_m = 0, .high_m = 2.3}, temp.Path(""), MakeRoomToDriveIn());
  const ReadGrid grid(temp.Path("grid/storey_0.yaml"));
  EXPECT_EQ(grid.At(0.1, 0.6), 0);
  EXPECT_EQ(grid.At(0.95, 0.8), 0);
  ExportOptions upside_down;
  upside_down.grid = {.low_m = 2, .high_m = 1};
  EXPECT_THROW(CheckFormats(upside_down), ConfigError);
  WriteGrids({}, temp.Path(""), MapResult());
  EXPECT_EQ(ReadGrid(temp.Path("grid/no_storey.yaml")).At(0.05, 0.05), 205);  // one unknown cell
}

}  // namespace
}  // namespace slcmap
