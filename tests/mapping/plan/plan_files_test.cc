#include "mapping/plan/plan_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "data/core/error.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using ::testing::HasSubstr;
using testing::MessageOf;

// The length of faces that lie on a line through a place, look that way, and are there.
double LengthOn(const BuildingPlan& plan, const Vector2d& p, const Vector2d& normal, double off_m) {
  double length_m = 0;
  for (const PlannedFace& face : plan.faces) {
    const bool looks_so = face.two_sided ? std::abs(face.Normal().dot(normal)) > 0.999
                                         : face.Normal().dot(normal) > 0.999;
    if (looks_so && std::abs(normal.dot(face.Middle() - p)) < off_m) length_m += face.Length();
  }
  return length_m;
}

// A room of 8 m by 5 m from (1, 1), in walls of 0.2 m, with a doorway of 0.9 m from x = 3 in the
// wall below, at 1 cm a pixel.
std::string DrawRoom(const std::string& folder) {
  cv::Mat1b image(700, 1000, uchar{255});
  const auto fill = [&](double x0, double y0, double x1, double y1, int value) {
    cv::rectangle(image, cv::Point(cvRound(100 * x0), 700 - cvRound(100 * y1)),
                  cv::Point(cvRound(100 * x1) - 1, 700 - cvRound(100 * y0) - 1), value, cv::FILLED);
  };
  fill(0.8, 0.8, 9.2, 6.2, 0);
  fill(1, 1, 9, 6, 255);
  fill(3, 0.8, 3.9, 1, 255);
  const std::string path = folder + "/room.png";
  cv::imwrite(path, image);
  return path;
}

void ExpectRoom(const BuildingPlan& plan, double off_m) {
  EXPECT_NEAR(LengthOn(plan, {5, 1}, {0, 1}, off_m), 8 - 0.9, 0.03) << "below";
  EXPECT_NEAR(LengthOn(plan, {5, 6}, {0, -1}, off_m), 8, 0.03) << "above";
  EXPECT_NEAR(LengthOn(plan, {1, 3}, {1, 0}, off_m), 5, 0.03) << "left";
  EXPECT_NEAR(LengthOn(plan, {9, 3}, {-1, 0}, off_m), 5, 0.03) << "right";
  EXPECT_NEAR(LengthOn(plan, {5, 6.2}, {0, 1}, off_m), 8.4, 0.03) << "outside";
  ASSERT_EQ(plan.openings.size(), 1u);
  const PlannedOpening& door = plan.openings[0];
  EXPECT_NEAR((door.end - door.start).norm(), 0.9, 0.011);
  EXPECT_LT((0.5 * (door.start + door.end) - Vector2d(3.45, 0.9)).norm(), 0.011);
}

TEST(PlanFiles, ReadsAnImageOfAScale) {
  const testing::TempFolder folder;
  const std::string path = DrawRoom(folder.Path());
  const auto plans = ReadPlans(path, 0.01);
  ASSERT_EQ(plans.size(), 1u);
  ExpectRoom(plans[0], 0.002);
  EXPECT_THAT(MessageOf<ConfigError>([&] { ReadPlans(path, 0); }), HasSubstr("--plan-pixel-m"));
  EXPECT_THAT(MessageOf<ConfigError>([&] { ReadPlans(path, 5); }), HasSubstr("--plan-pixel-m"));
  EXPECT_THAT(MessageOf<DataError>([&] { ReadPlans(path, 0.0002); }), HasSubstr("in metres"));
}

TEST(PlanFiles, RefusesWhatIsNoPlan) {
  const testing::TempFolder folder;
  const std::string text = folder.Write("notes.png", "no image");
  EXPECT_THAT(MessageOf<DataError>([&] { ReadPlans(text, 0.01); }), HasSubstr("no image"));
  const std::string white = folder.Path("white.png"), dark = folder.Path("dark.png");
  cv::imwrite(white, cv::Mat1b(100, 100, uchar{255}));
  cv::imwrite(dark, cv::Mat1b(100, 100, uchar{0}));
  EXPECT_THAT(MessageOf<DataError>([&] { ReadPlans(white, 0.01); }), HasSubstr("found no wall"));
  EXPECT_THAT(MessageOf<DataError>([&] { ReadPlans(dark, 0.01); }), HasSubstr("dark walls"));
}

// Walls, from outside along the doorway to inside.
const std::vector<Vector2d> kRoomRing = {{0.8, 0.8}, {3, 0.8},   {3, 1},     {1, 1},
                                         {1, 6},     {9, 6},     {9, 1},     {3.9, 1},
                                         {3.9, 0.8}, {9.2, 0.8}, {9.2, 6.2}, {0.8, 6.2}};

BuildingPlan ReadGeoJson(const std::string& geometry) {
  const testing::TempFolder folder;
  return ReadPlans(folder.Write("room.geojson", geometry), 0)[0];
}

TEST(PlanFiles, ReadsGeoJsonAreas) {
  std::string ring;
  for (const Vector2d& p : kRoomRing) ring += fmt::format("[{},{}],", p.x(), p.y());
  ExpectRoom(ReadGeoJson("{\"type\":\"FeatureCollection\",\"features\":[{\"type\":\"Feature\","
                         "\"properties\":{},\"geometry\":{\"type\":\"Polygon\",\"coordinates\":[[" +
                         ring + "[0.8,0.8]]]}}]}"),
             1e-6);
  const BuildingPlan room =
      ReadGeoJson("{\"type\":\"Polygon\",\"coordinates\":[[[1,1],[9,1],[9,6],[1,6],[1,1]]]}");
  EXPECT_NEAR(LengthOn(room, {5, 1}, {0, 1}, 1e-6), 8, 1e-6) << "a wide area is a room";
  EXPECT_NEAR(LengthOn(room, {9, 3}, {-1, 0}, 1e-6), 5, 1e-6);
  EXPECT_THAT(
      MessageOf<DataError>([] {
        ReadGeoJson(
            "{\"type\":\"LineString\",\"coordinates\":[[8.5417,47.3769],[8.5419,47.3769]]}");
      }),
      HasSubstr("in metres"));
}

std::string Dxf(const std::string& layer, int units, double scale) {
  std::string text = fmt::format(
      "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n{}\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n", units);
  for (std::size_t i = 0; i < kRoomRing.size(); ++i) {
    const Vector2d a = scale * kRoomRing[i], b = scale * kRoomRing[(i + 1) % kRoomRing.size()];
    text += fmt::format("0\nLINE\n8\n{}\n10\n{}\n20\n{}\n11\n{}\n21\n{}\n", layer, a.x(), a.y(),
                        b.x(), b.y());
  }
  return text + "0\nENDSEC\n0\nEOF\n";
}

TEST(PlanFiles, ReadsDxfInItsUnits) {
  const testing::TempFolder folder;
  const auto read = [&](const std::string& dxf) {
    return ReadPlans(folder.Write("room.dxf", dxf), 0)[0];
  };
  ExpectRoom(read(Dxf("A-Wall", 6, 1)), 1e-6);
  ExpectRoom(read(Dxf("WALLS", 4, 1000)), 1e-6);
  // Layers of two disciplines are of one storey, but not those of two storeys.
  std::string two = Dxf("A-WALL", 6, 1);
  two.replace(two.find("A-WALL"), 1, "S");
  ExpectRoom(read(two), 1e-6);
  two.replace(two.find("S-WALL"), 1, "2");
  EXPECT_EQ(ReadPlans(folder.Path("room.dxf"), 0).size(), 1u);
  EXPECT_EQ(ReadPlans(folder.Write("two.dxf", two), 0).size(), 2u);
  EXPECT_THAT(MessageOf<DataError>([&] { read(Dxf("FURNITURE", 6, 1)); }), HasSubstr("FURNITURE"));
  EXPECT_THAT(MessageOf<DataError>([&] { read(Dxf("WALL", 0, 1000)); }), HasSubstr("in metres"));
}

// A wall of 20 by 0.2 units as others write it: with a comment, and units of all kinds.
std::string Ifc(const std::string& unit) {
  return "ISO-10303-21;\nDATA;\n/* don't; */\n#1=IFCUNITASSIGNMENT((#2));\n" + unit +
         "#5=IFCSIUNIT(*,.LENGTHUNIT.,.CENTI.,.METRE.);\n"
         "#10=IFCCARTESIANPOINT((0.,0.,0.));\n#11=IFCAXIS2PLACEMENT3D(#10,$,$);\n"
         "#12=IFCLOCALPLACEMENT($,#11);\n#13=IFCRECTANGLEPROFILEDEF(.AREA.,$,$,20.,0.2);\n"
         "#14=IFCDIRECTION((0.,0.,1.));\n#15=IFCEXTRUDEDAREASOLID(#13,#11,#14,3.);\n"
         "#16=IFCSHAPEREPRESENTATION($,'Body','SweptSolid',(#15));\n"
         "#17=IFCPRODUCTDEFINITIONSHAPE($,$,(#16));\n"
         "#18=IFCWALL('a',$,$,$,$,#12,#17,$,$);\nENDSEC;\nEND-ISO-10303-21;\n";
}

TEST(PlanFiles, ReadsIfcInItsUnits) {
  const testing::TempFolder folder;
  const auto length_m = [&](const std::string& unit) {
    const BuildingPlan plan = ReadPlans(folder.Write("wall.ifc", Ifc(unit)), 0)[0];
    double most_m = 0;
    for (const PlannedFace& face : plan.faces) most_m = std::max(most_m, face.Length());
    return most_m;
  };
  EXPECT_NEAR(length_m("#2=IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.);\n"), 20, 1e-6);
  EXPECT_NEAR(length_m("#2=IFCCONVERSIONBASEDUNIT(#4,.LENGTHUNIT.,'FOOT',#3);\n"
                       "#3=IFCMEASUREWITHUNIT(IFCLENGTHMEASURE(0.3048),#6);\n"
                       "#6=IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.);\n"),
              20 * 0.3048, 2e-3);
}

}  // namespace
}  // namespace slcmap
