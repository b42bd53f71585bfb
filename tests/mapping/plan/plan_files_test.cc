#include "mapping/plan/plan_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

TEST(PlanFiles, ReadsAnImage) {
  const testing::TempFolder folder;
  const auto plans = ReadPlans(DrawRoom(folder.Path()), 0.01);
  ASSERT_EQ(plans.size(), 1u);
  ExpectRoom(plans[0], 0.002);
}

TEST(PlanFiles, ImageNeedsItsScale) {
  const testing::TempFolder folder;
  const std::string path = DrawRoom(folder.Path());
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

constexpr char kRoomRings[] =
    "[[[0.8,0.8],[3,0.8],[3,1],[1,1],[1,6],[9,6],[9,1],[3.9,1],[3.9,0.8],[9.2,0.8],[9.2,6.2],"
    "[0.8,6.2],[0.8,0.8]]]";

TEST(PlanFiles, ReadsGeoJsonAreas) {
  const testing::TempFolder folder;
  const std::string path = folder.Write(
      "room.geojson",
      std::string("{\"type\":\"FeatureCollection\",\"features\":[{\"type\":\"Feature\","
                  "\"properties\":{},\"geometry\":{\"type\":\"Polygon\",\"coordinates\":") +
          kRoomRings + "}}]}");
  ExpectRoom(ReadPlans(path, 0)[0], 1e-6);
}

TEST(PlanFiles, WideGeoJsonAreasAreRooms) {
  const testing::TempFolder folder;
  const std::string path = folder.Write(
      "room.geojson", "{\"type\":\"Polygon\",\"coordinates\":[[[1,1],[9,1],[9,6],[1,6],[1,1]]]}");
  const BuildingPlan plan = ReadPlans(path, 0)[0];
  EXPECT_NEAR(LengthOn(plan, {5, 1}, {0, 1}, 1e-6), 8, 1e-6);
  EXPECT_NEAR(LengthOn(plan, {9, 3}, {-1, 0}, 1e-6), 5, 1e-6);
}

TEST(PlanFiles, DegreesAreRefused) {
  const testing::TempFolder folder;
  const std::string path =
      folder.Write("room.geojson",
                   "{\"type\":\"LineString\",\"coordinates\":[[8.5417,47.3769],[8.5419,47.3769]]}");
  EXPECT_THAT(MessageOf<DataError>([&] { ReadPlans(path, 0); }), HasSubstr("in metres"));
}

std::string Dxf(const std::string& layer, const std::string& insunits, double scale) {
  std::string text = "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n" + insunits +
                     "\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n";
  const std::vector<Vector2d> ring = {{0.8, 0.8}, {3, 0.8},   {3, 1},     {1, 1},
                                      {1, 6},     {9, 6},     {9, 1},     {3.9, 1},
                                      {3.9, 0.8}, {9.2, 0.8}, {9.2, 6.2}, {0.8, 6.2}};
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Vector2d a = scale * ring[i], b = scale * ring[(i + 1) % ring.size()];
    text += "0\nLINE\n8\n" + layer + "\n10\n" + std::to_string(a.x()) + "\n20\n" +
            std::to_string(a.y()) + "\n11\n" + std::to_string(b.x()) + "\n21\n" +
            std::to_string(b.y()) + "\n";
  }
  return text + "0\nENDSEC\n0\nEOF\n";
}

TEST(PlanFiles, ReadsDxfInItsUnits) {
  const testing::TempFolder folder;
  ExpectRoom(ReadPlans(folder.Write("m.dxf", Dxf("A-Wall", "6", 1)), 0)[0], 1e-6);
  ExpectRoom(ReadPlans(folder.Write("mm.dxf", Dxf("WALLS", "4", 1000)), 0)[0], 1e-6);
}

TEST(PlanFiles, RefusesDxfWithoutWallsOrUnits) {
  const testing::TempFolder folder;
  const std::string other = folder.Write("a.dxf", Dxf("FURNITURE", "6", 1));
  EXPECT_THAT(MessageOf<DataError>([&] { ReadPlans(other, 0); }), HasSubstr("FURNITURE"));
  const std::string large = folder.Write("b.dxf", Dxf("WALL", "0", 1000));
  EXPECT_THAT(MessageOf<DataError>([&] { ReadPlans(large, 0); }), HasSubstr("in metres"));
}

}  // namespace
}  // namespace slcmap
