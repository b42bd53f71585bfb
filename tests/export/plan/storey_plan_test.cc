#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "data/core/error.h"
#include "export/plan/drawing.h"
#include "export/plan/sheet.h"
#include "tests/testing/made_building.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using ::testing::Not;
using ::testing::UnorderedElementsAre;

std::vector<std::string> LengthsOf(const StoreyPlan& plan) {
  std::vector<std::string> lengths;
  for (const Dimension& dimension : plan.dimensions) lengths.push_back(dimension.Text());
  return lengths;
}

std::vector<std::string> TextsOf(const std::vector<DrawnText>& texts) {
  std::vector<std::string> all;
  for (const DrawnText& text : texts) all.push_back(text.text);
  return all;
}

TEST(StoreyPlanTest, RoomsHaveNamesAreasAndHeights) {
  const PlanSet plans = MakePlans(testing::MakeBuilding(2), {});
  ASSERT_EQ(plans.storeys.size(), 2u);
  EXPECT_THAT(TextsOf(plans.storeys[0].room_texts),
              UnorderedElementsAre("Room 1", "12.00 m\u00b2", "h 2.50"));
  EXPECT_THAT(TextsOf(plans.storeys[1].room_texts), Contains("Room 2"));
  Building building = testing::MakeBuilding();
  building.rooms[0].bounded = 0.6;
  EXPECT_THAT(TextsOf(MakePlans(building, {}).storeys[0].room_texts),
              Contains("about 12.00 m\u00b2"));
}

TEST(StoreyPlanTest, RoomsAndDoorsAreCalledAsPeopleCallThem) {
  Building building = testing::MakeBuilding();
  building.rooms[0].name = "K\u00fcche";
  building.walls[0].openings[0].name = "D-01";
  const StoreyPlan plan = MakePlans(building, {}).storeys[0];
  EXPECT_THAT(TextsOf(plan.room_texts), Contains("K\u00fcche"));
  EXPECT_EQ(OpeningText(building.walls[0].openings[0], false), "D-01 0.90 x 2.10");
}

TEST(StoreyPlanTest, RoomsOfWhichLittleIsHeldSaySo) {
  Building building = testing::MakeBuilding();
  building.rooms[0].seen_share = 0.74;
  const std::vector<std::string> texts = TextsOf(MakePlans(building, {}).storeys[0].room_texts);
  EXPECT_THAT(texts, Contains("74 % of what was seen"));
  building.rooms[0].seen_share = 0.85;
  EXPECT_THAT(TextsOf(MakePlans(building, {}).storeys[0].room_texts),
              UnorderedElementsAre("Room 1", "12.00 m\u00b2", "h 2.50"));
}

TEST(StoreyPlanTest, OnlyBetweenWallsAreThereDimensions) {
  Building building = testing::MakeBuilding();
  building.walls.erase(building.walls.begin() + 1);  // at the left
  EXPECT_THAT(LengthsOf(MakePlans(building, {}).storeys[0]), Contains("4.00").Times(0));
  building = testing::MakeBuilding();
  PlanWall across = building.walls[1];
  across.start.x() = across.end.x() = 2;
  across.thickness_assumed = true;
  building.walls.push_back(across);
  const PlanSet plans = MakePlans(building, {});
  for (const Dimension& dimension : plans.storeys[0].dimensions) {
    if (dimension.offset_m == 0) {
      EXPECT_NEAR(dimension.Length(), 3, 1e-9);
    }
  }
}

TEST(StoreyPlanTest, ChainsAreOnAllSidesAndAboutWhereABackWasNotSeen) {
  for (const double turn_rad : {0.0, 0.4}) {  // maps may keep other axes
    const auto& lengths = LengthsOf(MakePlans(testing::MakeBuilding(1, turn_rad), {}).storeys[0]);
    // Below and above: the wall at the right has an assumed thickness. At the left and the right:
    // both walls were measured on both sides.
    EXPECT_THAT(lengths, UnorderedElementsAre("4.00", "3.00",                    // in the room
                                              "0.20", "4.00", "~0.20", "~4.40",  //
                                              "0.20", "4.00", "~0.20", "~4.40",  //
                                              "0.20", "3.00", "0.20", "3.40",    //
                                              "0.20", "3.00", "0.20", "3.40"));
  }
}

// Two rooms, one above the other, of whose common wall at the left only the upper part was seen.
TEST(StoreyPlanTest, ChainsAreAboutWhereABorderWasNotSeen) {
  Building building = testing::MakeBuilding();
  building.walls.clear();
  building.rooms.clear();
  testing::AddRoom({0, 0}, {4, 3}, 0, 0, &building);
  testing::AddRoom({0, 3.2}, {4, 3}, 0, 0, &building);
  const auto below = [&] {
    std::vector<std::string> lengths;
    for (const Dimension& dimension : MakePlans(building, {}).storeys[0].dimensions) {
      const bool is_below = dimension.offset_m != 0 && dimension.from.y() < 0;
      if (is_below && std::abs((dimension.to - dimension.from).x()) > 1) {
        lengths.push_back(dimension.Text());
      }
    }
    return lengths;
  };
  EXPECT_THAT(below(), Contains("4.00"));
  std::erase_if(building.walls, [](const PlanWall& wall) {
    return wall.start.x() < 0.01 && wall.end.x() < 0.01 && wall.start.y() < 3.1;
  });
  EXPECT_THAT(below(), Contains("~4.00"));
  EXPECT_THAT(below(), Not(Contains("4.00")));
}

TEST(StoreyPlanTest, ChainsHoldOnlyWallsThatAreSeenFromTheirSide) {
  Building building = testing::MakeBuilding();
  building.rooms.clear();
  building.walls.clear();
  testing::AddRoom({0, 0}, {4, 3}, 0, 0, &building);
  testing::AddRoom({4.2, 0}, {2, 3}, 0, 0, &building);
  testing::AddRoom({0, 3.2}, {6.2, 5}, 0, 0, &building);  // as long as both, above them
  int below = 0, above = 0;
  const PlanSet plans = MakePlans(building, {});
  for (const Dimension& dimension : plans.storeys[0].dimensions) {
    if (dimension.offset_m == 0 || std::abs((dimension.to - dimension.from).x()) < 1e-6) continue;
    const bool parts_at_4 =
        std::abs(dimension.from.x() - 4) < 0.01 || std::abs(dimension.to.x() - 4) < 0.01;
    (dimension.from.y() < 1 ? below : above) += parts_at_4;
  }
  EXPECT_GT(below, 0);
  EXPECT_EQ(above, 0);
}

TEST(StoreyPlanTest, ChainsAreOutsideOfRoomsWhoseWallsWereNotSeen) {
  Building building = testing::MakeBuilding();
  building.walls.erase(building.walls.begin() + 2);  // the upper or the lower one
  building.rooms[0].polygon.outline = {{-2, -3}, {6, -3}, {6, 7}, {-2, 7}};
  const PlanTextSizes sizes(50);
  const PlanSet plans = MakePlans(building, {});
  for (const Dimension& dimension : plans.storeys[0].dimensions) {
    if (dimension.offset_m == 0) continue;
    const Eigen::Vector2d end = dimension.LineEnd();
    EXPECT_TRUE(end.x() < -2 || end.x() > 6 || end.y() < -3 || end.y() > 7) << end.transpose();
  }
}

TEST(StoreyPlanTest, WallsAndOpeningsSayWhatTheyAreAsOptionsAsk) {
  const StoreyPlan plan = MakePlans(testing::MakeBuilding(), {}).storeys[0];
  EXPECT_THAT(TextsOf(plan.wall_texts),
              IsSupersetOf({"W0 0.20", "W1 0.20", "W2 0.20", "W3 ~0.20",  // number, thickness
                            "0.90 x 2.10", "1.20 x 1.40 +0.90"}));        // clear sizes
  EXPECT_THAT(TextsOf(plan.wall_texts), Not(Contains("\u03c3 4 mm")));
  PlanOptions options;
  options.millimetres = options.wall_sigma = true;
  const StoreyPlan asked = MakePlans(testing::MakeBuilding(), options).storeys[0];
  EXPECT_THAT(LengthsOf(asked), Contains("4000"));
  EXPECT_THAT(TextsOf(asked.wall_texts), Contains("900 x 2100"));
  EXPECT_THAT(TextsOf(asked.room_texts), Contains("h 2500"));
  EXPECT_THAT(TextsOf(asked.wall_texts), Contains("\u03c3 4 mm").Times(4));
}

TEST(StoreyPlanTest, OnlyDoorsThatWereWalkedThroughSwing) {
  Building building = testing::MakeBuilding();
  const auto swings = [&] {
    const PlanSet plans = MakePlans(building, {});
    const auto& paths = plans.storeys[0].openings.paths;
    return std::count_if(paths.begin(), paths.end(),
                         [](const DrawnPath& path) { return path.points.size() > 2; });
  };
  EXPECT_EQ(swings(), 1);
  building.walls[0].openings[0].walked = false;
  EXPECT_EQ(swings(), 0);
}

// All texts but those of the chains, whose places follow from the walls.
std::vector<Box> TextBoxes(const PlanSet& plans) {
  const StoreyPlan& plan = plans.storeys[0];
  const PlanTextSizes sizes(plans.format.scale);
  std::vector<Box> boxes;
  for (const auto* texts : {&plan.room_texts, &plan.wall_texts}) {
    for (const DrawnText& text : *texts) boxes.push_back(MakeBox(text));
  }
  for (const Dimension& dimension : plan.dimensions) {
    boxes.push_back(MakeBox(DimensionText(dimension, sizes)));
  }
  for (Box& box : boxes) box.half.y() *= 0.6;  // without what is kept clear around them
  return boxes;
}

TEST(StoreyPlanTest, TextsDoNotLieOverEachOther) {
  Building building;
  building.storeys = {{0, 0, 2.5}};
  for (int i = 0; i < 12; ++i) {  // rooms down to 0.6 m, side by side
    testing::AddRoom({5.0 * (i % 4), 4.0 * (i / 4)}, {4.4 - 0.34 * i, 3.4 - 0.25 * i}, 0.01, 0,
                     &building);
  }
  PlanOptions options;
  options.wall_sigma = true;
  for (const int scale : {50, 100, 200}) {
    options.scale = scale;
    const std::vector<Box> boxes = TextBoxes(MakePlans(building, options));
    EXPECT_GT(boxes.size(), 20u);
    for (size_t i = 0; i < boxes.size(); ++i) {
      for (size_t j = 0; j < i; ++j) EXPECT_FALSE(Overlap(boxes[i], boxes[j])) << scale;
    }
  }
}

TEST(SheetSizeTest, TheSmallestSheetThatHoldsThePlan) {
  EXPECT_EQ(ChooseFormat({4, 3}, {}).name, "A4");
  EXPECT_EQ(ChooseFormat({4, 3}, {}).scale, 50);
  EXPECT_EQ(ChooseFormat({20, 12}, {}).name, "A2");
  EXPECT_EQ(ChooseFormat({20, 12}, {}).scale, 50);
  EXPECT_EQ(ChooseFormat({40, 30}, {}).scale, 100);
  EXPECT_EQ(ChooseFormat({1000, 500}, {}).scale, 1000);
  EXPECT_EQ(ChooseFormat({20, 12}, {.scale = 100}).name, "A4");
}

TEST(SheetSizeTest, ScalesThatCannotBeAreRefused) {
  const auto message = [](const Eigen::Vector2d& size_m, int scale) {
    return testing::MessageOf<ConfigError>([&] { ChooseFormat(size_m, {.scale = scale}); });
  };
  EXPECT_THAT(message({100, 80}, 50),
              HasSubstr("found 1:50, which A0 does not hold, expected 1:200"));
  EXPECT_THAT(message({1, 1}, -1), HasSubstr("plan scale: found 1:-1"));
  EXPECT_THROW(ChooseFormat({std::numeric_limits<double>::quiet_NaN(), 1}, {}), DataError);
}

TEST(TakenPlacesTest, BoxesThatAreTurnedOverlapWhereTheirAreasDo) {
  const Box upright = {{0, 0}, {1, 1}, 0};
  EXPECT_TRUE(Overlap(upright, {{1.9, 0}, {1, 1}, 0}));
  EXPECT_FALSE(Overlap(upright, {{2.1, 0}, {1, 1}, 0}));
  // Its bounding box would reach the upright one, it does not.
  EXPECT_FALSE(Overlap(upright, {{1.9, 1.9}, {1.2, 1.2}, M_PI / 4}));
  EXPECT_TRUE(Overlap(upright, {{1.9, 0}, {1.2, 1.2}, M_PI / 4}));
}

TEST(TakenPlacesTest, LinesMayCrossLinesButNeitherTextsNorWalls) {
  TakenPlaces taken;
  taken.AddLine({{0, 0}, {5, 0.1}, 0});
  taken.AddText({{0, 3}, {2, 0.5}, 0});
  const Box across = {{3, 0}, {5, 0.1}, M_PI / 2};
  EXPECT_TRUE(taken.HasRoomForLine(across, 0));
  EXPECT_FALSE(taken.HasRoomForText(across));
  EXPECT_FALSE(taken.HasRoomForLine({{0, 0}, {5, 0.1}, M_PI / 2}, 0));
  taken.AddWall({{3, 4}, {1, 0.5}, 0});
  EXPECT_FALSE(taken.HasRoomForLine(across, 1));
  EXPECT_TRUE(taken.HasRoomForLine(across, 1.6));
  EXPECT_TRUE(taken.IsAtWall({3, 4.55}, 0.1));
  EXPECT_FALSE(taken.IsAtWall({3, 4.65}, 0.1));
}

TEST(TakenPlacesTest, TextsAreReadFromBelowOrFromTheRight) {
  for (int degrees = 0; degrees < 360; degrees += 10) {
    const double angle_rad = degrees * M_PI / 180;
    const double read_rad = ReadableAngle({std::cos(angle_rad), std::sin(angle_rad)});
    EXPECT_LE(read_rad, M_PI / 2 + 0.05) << degrees;
    EXPECT_GT(read_rad, -M_PI / 2 + 0.04) << degrees;
    EXPECT_NEAR(std::sin(read_rad - angle_rad), 0, 1e-9) << degrees;
  }
}

}  // namespace
}  // namespace slcmap
