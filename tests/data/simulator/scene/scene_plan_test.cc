// Storeys made of drawings.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "data/core/error.h"
#include "data/simulator/scene/scene.h"
#include "data/simulator/truth.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::MessageOf;
using ::testing::SizeIs;
using testing::TempFolder;

constexpr double kPixel_m = 0.02;

// 8 by 5 m outside: walls of 0.3 m, glazed where x is largest (0.1 m); a wall of 0.2 m from y = 0.3
// to 4.7 at x = 4 to 4.2, with a gap of 1 m from y = 1 to 2; and a speck of dirt.
cv::Mat TwoDrawnRooms() {
  const int rows = 300;
  cv::Mat drawing(rows, 440, CV_8U, cv::Scalar(255));
  const auto fill = [&](double x0, double y0, double x1, double y1, int grey) {
    const auto pixels = [](double metres) { return static_cast<int>(std::lround(metres / 0.02)); };
    const cv::Rect box(pixels(x0), rows - pixels(y1), pixels(x1) - pixels(x0),
                       pixels(y1) - pixels(y0));
    drawing(box) = cv::Scalar(grey);
  };
  fill(0.4, 0.5, 8.4, 5.5, 0);
  fill(0.7, 0.8, 8.3, 5.2, 255);
  fill(4.4, 0.8, 4.6, 5.2, 60);
  fill(4.4, 1.5, 4.6, 2.5, 255);
  fill(6, 2, 6.04, 2.04, 0);
  return drawing;
}

struct DrawnScene {
  TempFolder folder;

  std::string Write(const std::string& keys) const {
    cv::imwrite(folder.Path("plan.png"), TwoDrawnRooms());
    return folder.Write("scene.yaml", "plan: {image: plan.png, pixel_m: 0.02, " + keys + "}\n");
  }
};

// The face with this normal that is nearest to an offset.
const TrueWall* FindFace(const std::vector<TrueWall>& walls, const Eigen::Vector2d& normal,
                         double offset_m) {
  const TrueWall* best = nullptr;
  for (const TrueWall& wall : walls) {
    if (wall.normal.head<2>().dot(normal) < 0.999) continue;
    if (best && std::abs(wall.offset_m - offset_m) >= std::abs(best->offset_m - offset_m)) continue;
    best = &wall;
  }
  return best;
}

TEST(ScenePlan, WallsStandWhereTheyAreDrawn) {
  const DrawnScene drawn;
  const Scene scene = ReadScene(drawn.Write("furniture: 0, height: 2.6"));
  const std::vector<TrueWall> walls = TrueWalls(scene);
  struct Expected {
    Eigen::Vector2d normal;
    double offset_m;
  };
  // Faces within, without, and of the wall between the rooms.
  for (const auto& [normal, offset_m] :
       {Expected{{1, 0}, 0.7}, Expected{{0, 1}, 0.8}, Expected{{-1, 0}, -8.3},
        Expected{{0, -1}, -5.2}, Expected{{-1, 0}, -0.4}, Expected{{0, -1}, -0.5},
        Expected{{1, 0}, 8.4}, Expected{{0, 1}, 5.5}, Expected{{-1, 0}, -4.4},
        Expected{{1, 0}, 4.6}}) {
    const TrueWall* face = FindFace(walls, normal, offset_m);
    ASSERT_NE(face, nullptr);
    EXPECT_NEAR(face->offset_m, offset_m, 0.1 * kPixel_m) << normal.transpose();
    for (const Eigen::Vector3d& corner : face->outline_world) {
      EXPECT_TRUE(std::abs(corner.z()) < 1e-6 || std::abs(corner.z() - 2.6) < 1e-6);
    }
  }
}

// The stairs of its pixels are no edges.
TEST(ScenePlan, AWallAcrossThePixelsOfADrawingThatWasMadeLargerIsStraight) {
  cv::Mat small(150, 220, CV_8U, cv::Scalar(255)), drawing;
  cv::line(small, {40, 30}, {170, 110}, cv::Scalar(0), 8);
  cv::resize(small, drawing, {}, 2, 2, cv::INTER_NEAREST);
  const TempFolder folder;
  cv::imwrite(folder.Path("plan.png"), drawing);
  const std::string scene = folder.Write(
      "scene.yaml", "plan: {image: plan.png, pixel_m: 0.01, furniture: 0, floor: carpet}\n");
  const std::vector<TrueWall> walls = TrueWalls(ReadScene(scene));
  // The wall is 3.05 m long.
  EXPECT_EQ(std::ranges::count_if(walls,
                                  [](const TrueWall& wall) {
                                    const auto& corners = wall.outline_world;
                                    return (corners[1] - corners[0]).head<2>().norm() > 2.5;
                                  }),
            2);
}

TEST(ScenePlan, AGapIsADoorAndAThinWallIsGlazed) {
  const DrawnScene drawn;
  const Scene scene = ReadScene(drawn.Write("furniture: 0, leaf_deg: [80], daylight: 5"));
  const std::vector<TrueWall> walls = TrueWalls(scene);
  const TrueWall* front = FindFace(walls, {-1, 0}, -4.4);
  const TrueWall* back = FindFace(walls, {1, 0}, 4.6);
  ASSERT_TRUE(front && back);
  for (const TrueWall* face : {front, back}) {
    ASSERT_THAT(face->openings, SizeIs(1));
    EXPECT_TRUE(face->openings[0].is_door);
    EXPECT_TRUE(face->openings[0].is_open);
    EXPECT_NEAR(face->openings[0].clear_width_m, 1, 2 * kPixel_m);
    for (const Eigen::Vector3d& corner : face->openings[0].outline_world) {
      EXPECT_GT(corner.y(), 1.5 - kPixel_m);
      EXPECT_LT(corner.y(), 2.5 + kPixel_m);
      EXPECT_LT(corner.z(), 2.1 + 1e-6);
    }
  }
  EXPECT_EQ(front->openings[0].id, back->openings[0].id);
  const TrueWall* glazed = FindFace(walls, {-1, 0}, -8.3);
  ASSERT_THAT(glazed->openings, SizeIs(1));
  EXPECT_FALSE(glazed->openings[0].is_door);
  const auto panes = std::count_if(scene.lamps.begin(), scene.lamps.end(),
                                   [](const SceneLamp& lamp) { return lamp.radiance == 5; });
  EXPECT_EQ(panes, 2);  // one for each face
  EXPECT_THAT(FindFace(walls, {1, 0}, 0.7)->openings, SizeIs(0));
}

TEST(ScenePlan, RoomsAndLampsAreWithinTheWalls) {
  const DrawnScene drawn;
  const Scene scene = ReadScene(drawn.Write("furniture: 0, daylight: 0, lamps_m: 2"));
  double area_m2 = 0;
  const std::vector<TrueRoom> rooms = TrueRooms(scene);
  ASSERT_THAT(rooms, SizeIs(2));
  for (const TrueRoom& room : rooms) area_m2 += room.area_m2;
  EXPECT_NEAR(area_m2, (3.7 + 3.7) * 4.4, 0.1);
  EXPECT_GE(scene.lamps.size(), 4u);
  for (const SceneLamp& lamp : scene.lamps) {
    const Eigen::Vector3f middle = lamp.a + 0.5f * (lamp.u + lamp.v);
    EXPECT_TRUE(middle.x() > 0.7 && middle.x() < 8.3 && middle.y() > 0.8 && middle.y() < 5.2);
  }
}

TEST(ScenePlan, FurnitureKeepsClearOfWalls) {
  const DrawnScene drawn;
  const Scene bare = ReadScene(drawn.Write("furniture: 0"));
  const Scene full = ReadScene(drawn.Write("furniture: 1, seed: 3"));
  const auto fittings = [](const Scene& scene) {
    return std::count_if(scene.bodies.begin(), scene.bodies.end(), [](const SceneBody& body) {
      return body.is_fitting && body.kind != "lamp" && body.kind != "door" && body.kind != "window";
    });
  };
  EXPECT_EQ(fittings(bare), 0);
  EXPECT_GE(fittings(full), 4);
  const cv::Mat drawing = TwoDrawnRooms();
  for (const SceneBody& body : full.bodies) {
    if (!body.is_fitting || body.kind == "door" || body.kind == "window") continue;
    const Eigen::Vector3d middle = body.world_body * body.box_body.center();
    const int x = static_cast<int>(middle.x() / kPixel_m);
    const int y = drawing.rows - 1 - static_cast<int>(middle.y() / kPixel_m);
    EXPECT_EQ(drawing.at<uint8_t>(y, x), 255) << body.kind;
  }
}

TEST(ScenePlan, RefusesWhatItCannotBuild) {
  const DrawnScene drawn;
  for (const auto& [keys, expected] :
       {std::pair{"height: 1", "plan.height: found 1, expected 2 to 20"},
        std::pair{"floor: lava", "plan.floor: found no material 'lava'"},
        std::pair{"image: none.png", "none.png: expected an image"},
        std::pair{"walls: []", "plan.walls: expected at least one"},
        std::pair{"rooms: 3", "rooms"}}) {
    const std::string path = drawn.folder.Write(
        "wrong.yaml",
        std::string("plan: {") +
            (std::string(keys).starts_with("image") ? "" : "image: plan.png, pixel_m: 0.02, ") +
            keys + "}\n");
    drawn.Write("furniture: 0");
    EXPECT_THAT(MessageOf<ConfigError>([&] { ReadScene(path); }),
                AllOf(HasSubstr("wrong.yaml"), HasSubstr(expected)));
  }
  cv::imwrite(drawn.folder.Path("plan.png"), cv::Mat(40, 40, CV_8U, cv::Scalar(255)));
  const std::string path = drawn.folder.Write("white.yaml", "plan: {image: plan.png}\n");
  EXPECT_THAT(MessageOf<ConfigError>([&] { ReadScene(path); }), HasSubstr("no dark pixel"));
}

}  // namespace
}  // namespace slcmap
