// Sections and elevations as files have them, against the building that they are of.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "data/core/error.h"
#include "data/io/file.h"
#include "export/export.h"
#include "export/plan/section_drawing.h"
#include "export/scene/formats.h"
#include "tests/testing/made_building.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kMost_m = 1e-3;

// From its lower or left end to the other one.
struct ReadLine {
  double x0, y0, x1, y1;
};

ReadLine Sorted(ReadLine line) {
  if (std::pair(line.x1, line.y1) < std::pair(line.x0, line.y0)) {
    std::swap(line.x0, line.x1);
    std::swap(line.y0, line.y1);
  }
  return line;
}

MATCHER_P4(IsLine, x0, y0, x1, y1, "") {
  return std::abs(arg.x0 - x0) < kMost_m && std::abs(arg.y0 - y0) < kMost_m &&
         std::abs(arg.x1 - x1) < kMost_m && std::abs(arg.y1 - y1) < kMost_m;
}

// Two lines of a code and its value each.
class ReadDxf {
 public:
  explicit ReadDxf(const std::string& path) {
    std::istringstream text(ReadFile(path));
    std::string code, value;
    while (std::getline(text, code) && std::getline(text, value)) {
      if (std::stoi(code) == 0) entities_.emplace_back().kind = value;
      if (!entities_.empty()) entities_.back().values[std::stoi(code)] = value;
    }
  }

  std::vector<ReadLine> Lines(const std::string& layer) const {
    std::vector<ReadLine> lines;
    for (const Entity& entity : entities_) {
      if (entity.kind != "LINE" || entity.values.at(8) != layer) continue;
      lines.push_back(
          Sorted({entity.Number(10), entity.Number(20), entity.Number(11), entity.Number(21)}));
    }
    return lines;
  }

  // Between the points that dimensions are of.
  std::vector<double> Lengths() const {
    std::vector<double> lengths;
    for (const Entity& entity : entities_) {
      if (entity.kind != "DIMENSION") continue;
      lengths.push_back(
          std::hypot(entity.Number(14) - entity.Number(13), entity.Number(24) - entity.Number(23)));
    }
    return lengths;
  }

 private:
  struct Entity {
    std::string kind;
    std::map<int, std::string> values;
    double Number(int code) const { return std::stod(values.at(code)); }
  };
  std::vector<Entity> entities_;
};

class SectionTest : public ::testing::Test {
 protected:
  SectionTest() {
    map_.complete = true;
    map_.building = testing::MakeBuilding(2);
    // Storeys are 3 m apart; rooms of the made building all have their floor at 0.
    map_.building.rooms[1].floor_m = 3;
  }

  ReadDxf Dxf(const std::string& name) const {
    WriteDxf(options_, temp_.Path(""), map_);
    return ReadDxf(temp_.Path("plan/" + name + ".dxf"));
  }

  // The straight paths of a pen, in metres at the sheet's scale, from its upper left corner.
  std::vector<ReadLine> Svg(const std::string& name, const std::string& pen) const {
    WriteSvgPlans(options_, temp_.Path(""), map_);
    const std::string svg = ReadFile(temp_.Path("plan/" + name + ".svg"));
    const double scale = 1e-3 * std::stod(svg.substr(svg.find(" 1:") + 3));
    const size_t from = svg.find("<g id=\"" + pen + "\"");
    const std::string group = svg.substr(from, svg.find("</g>", from) - from);
    const std::regex path("M([-0-9.]+) ([-0-9.]+)L([-0-9.]+) ([-0-9.]+)\"");
    std::vector<ReadLine> lines;
    for (std::sregex_iterator it(group.begin(), group.end(), path), end; it != end; ++it) {
      const auto number = [&](size_t i) { return scale * std::stod((*it)[i].str()); };
      lines.push_back(Sorted({number(1), -number(2), number(3), -number(4)}));
    }
    return lines;
  }

  MapResult map_;
  PlanOptions options_;
  testing::TempFolder temp_;
};

TEST_F(SectionTest, ADoorThatIsCutAndWallsAreWhereTheMapHasThem) {
  options_.sections = {"x=2.5"};  // towards larger x: the right of the drawing is smaller y
  const ReadDxf dxf = Dxf("section_1");
  const std::vector<ReadLine> walls = dxf.Lines("WALL");
  for (const double floor : {0.0, 3.0}) {
    EXPECT_THAT(walls, Contains(IsLine(-3, floor, -3, floor + 2.5)));      // a face
    EXPECT_THAT(walls, Contains(IsLine(-3.2, floor, -3.2, floor + 2.5)));  // its back
    EXPECT_THAT(walls, Contains(IsLine(0, floor + 2.1, 0, floor + 2.5)));  // over the door
    EXPECT_THAT(walls, Contains(IsLine(0, floor + 2.1, 0.2, floor + 2.1)));
    EXPECT_THAT(walls, Not(Contains(IsLine(0, floor, 0, floor + 2.5))));
  }
  const std::vector<double> lengths = dxf.Lengths();
  // Clear width, overall, clear height, height of the door, storeys, thickness.
  for (const double length : {3.0, 3.4, 2.5, 2.1, 0.5, 5.5, 0.2}) {
    EXPECT_THAT(lengths, Contains(::testing::DoubleNear(length, kMost_m))) << length;
  }
}

TEST_F(SectionTest, LinesAreWhereTheyAreAndNowhereElse) {
  options_.sections = {"x=1.5", "y=1.5", "y=1.5,back", "-1,0:5,3"};
  options_.elevations = {"sides"};
  const struct {
    std::string what, name, layer;
    ReadLine line;
    bool is_there = true;
  } kRows[] = {{"the sill of a window that is cut", "section_1", "WALL", {-3.2, 0.9, -3, 0.9}},
               {"its lintel", "section_1", "WALL", {-3.2, 2.3, -3, 2.3}},
               {"a wall without opening there", "section_1", "WALL", {0, 0, 0, 2.5}},
               {"a face that is cut", "section_2", "WALL", {4, 0, 4, 2.5}},
               {"its assumed back", "section_2", "WALL", {4.2, 0, 4.2, 2.5}, false},
               {"a window beyond", "section_2", "OPENING", {1, 0.9, 1, 2.3}},
               {"its lintel", "section_2", "OPENING", {1, 2.3, 2.2, 2.3}},
               {"the door on the other side", "section_3", "OPENING", {-3, 2.1, -2.1, 2.1}},
               {"not the window", "section_3", "OPENING", {-2.2, 2.3, -1, 2.3}, false},
               {"an outer corner", "elevation_bottom", "BEYOND", {-0.2, 0, -0.2, 2.5}},
               {"what is before", "elevation_bottom", "OPENING", {2.1, 0, 2.1, 2.1}},
               {"what is behind", "elevation_bottom", "OPENING", {1, 0.9, 1, 2.3}, false}};
  for (const auto& row : kRows) {
    const std::vector<ReadLine> lines = Dxf(row.name).Lines(row.layer);
    const bool is_there = std::ranges::any_of(lines, [&](const ReadLine& l) {
      return std::abs(l.x0 - row.line.x0) + std::abs(l.y0 - row.line.y0) < kMost_m &&
             std::abs(l.x1 - row.line.x1) + std::abs(l.y1 - row.line.y1) < kMost_m;
    });
    EXPECT_EQ(is_there, row.is_there) << row.name << ": " << row.what;
  }
  // A sloping line is as long as between the walls that it cuts.
  EXPECT_THAT(Dxf("section_4").Lengths(),
              Contains(::testing::DoubleNear(std::hypot(4, 2), kMost_m)));
  // Plans show where they are cut.
  EXPECT_THAT(Dxf("storey_0").Lines("S0_SECTION"),
              Contains(::testing::Field(&ReadLine::y0, ::testing::DoubleNear(1.5, kMost_m))));
}

TEST_F(SectionTest, SvgAndDxfHaveTheSameLines) {
  options_.sections = {"x=2.5", "-1,0:5,3"};
  options_.elevations = {"sides"};
  for (const char* name : {"section_1", "section_2", "elevation_bottom", "elevation_left"}) {
    const ReadDxf dxf = Dxf(name);
    for (const auto& [layer, pen] : {std::pair("WALL", "walls"), std::pair("OPENING", "openings"),
                                     std::pair("WALL_ASSUMED", "assumed")}) {
      std::vector<ReadLine> lines = dxf.Lines(layer);
      const std::vector<ReadLine> drawn = Svg(name, pen);
      const bool has_legend = drawn.size() > lines.size();
      ASSERT_TRUE(has_legend || drawn.size() == lines.size()) << name << " " << layer;
      if (lines.empty()) continue;
      const double x = drawn[0].x0 - lines[0].x0, y = drawn[0].y0 - lines[0].y0;
      for (const ReadLine& l : lines) {
        EXPECT_THAT(drawn, Contains(IsLine(l.x0 + x, l.y0 + y, l.x1 + x, l.y1 + y))) << name;
      }
    }
  }
}

TEST_F(SectionTest, LinesOfTheMapBeyondAreDrawnAndHiddenByWalls) {
  MapLine seen, hidden, before;
  seen.start_world = {0.5, 2.98, 1};
  seen.end_world = {3.5, 2.98, 1};
  hidden.start_world = {0.5, 3.5, 1.2};
  hidden.end_world = {0.9, 3.5, 1.2};
  before.start_world = {0.5, 0.5, 1};
  before.end_world = {0.5, 1, 1};
  map_.lines = {seen, hidden, before};
  options_.sections = {"y=1.5"};
  const std::vector<ReadLine> lines = Dxf("section_1").Lines("LINE");
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_THAT(lines[0], IsLine(0.5, 1, 3.5, 1));
}

TEST_F(SectionTest, EachWallOfARoomHasItsElevation) {
  options_.elevations = {"rooms"};
  EXPECT_THAT(Dxf("room_2_top").Lines("OPENING"), Contains(IsLine(1, 3.9, 1, 5.3)));
  EXPECT_THAT(Dxf("room_1_left").Lengths(), Contains(::testing::DoubleNear(3, kMost_m)));
}

TEST_F(SectionTest, EachIsAFileOfEachFormat) {
  options_.sections = {"y=1.5"};
  EXPECT_THAT(WritePdfPlans(options_, temp_.Path(""), map_),
              Contains(::testing::EndsWith("plan/section_1.pdf")));
  WriteSvgPlans(options_, temp_.Path(""), map_);
  EXPECT_THAT(ReadFile(temp_.Path("plan/section_1.svg")),
              AllOf(HasSubstr(">Section 1-1<"), HasSubstr("y = 1.5, seen towards larger y"),
                    HasSubstr(">+3.00<")));
}

TEST(SectionOptionTest, WhatIsNoSectionIsRefusedWithTheForms) {
  for (const char* text : {"", "x", "x=", "z=1", "x=a", "x=nan", "x=1,forth", "1,2", "1,2:3",
                           "1,2:1,2", "1,2:3,4,5", "x=1 ", "x=1e9"}) {
    EXPECT_THAT(testing::MessageOf<ConfigError>([&] { ParseSection(text, 1); }),
                AllOf(HasSubstr("section: found '" + std::string(text) + "'"),
                      HasSubstr("x=3.2 or 1,2:8,2"), Not(HasSubstr("\n"))));
  }
  ExportOptions options;
  options.plan.elevations = {"side"};
  EXPECT_THAT(testing::MessageOf<ConfigError>([&] { CheckFormats(options); }),
              HasSubstr("did you mean 'sides'?"));
  options.plan.elevations = {"sides"};
  options.formats = {"glb", "ply"};
  EXPECT_THAT(testing::MessageOf<ConfigError>([&] { CheckFormats(options); }),
              HasSubstr("found glb, ply, expected svg, pdf or dxf too"));
}

TEST_F(SectionTest, OneThatPassesTheBuildingIsRefused) {
  options_.sections = {"x=9"};
  EXPECT_THAT(testing::MessageOf<ConfigError>([&] { SectionViews(map_.building, options_); }),
              HasSubstr("found 'x=9', which passes the building, expected one through x -0.20 to "
                        "4.20 and y -0.20 to 3.20"));
  EXPECT_THAT(testing::MessageOf<ConfigError>([&] { SectionViews(Building(), options_); }),
              HasSubstr("without walls and rooms"));
}

}  // namespace
}  // namespace slcmap
