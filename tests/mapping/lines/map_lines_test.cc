#include "mapping/lines/map_lines.h"

#include <gtest/gtest.h>

#include <opencv2/core/utility.hpp>

#include "tests/mapping/lines/painted_wall.h"

namespace slcmap {
namespace {

using testing::MovingViews;
using testing::PaintedWall;
using testing::WallRectangle;

constexpr double kDistance_m = 2;

std::vector<BuildingAxis> WallAxes() {
  return {{LineAxis::kVertical, -1, -1, Eigen::Vector3d::UnitZ(), 0.001},
          {LineAxis::kX, 0, -1, Eigen::Vector3d::UnitX(), 0.001},
          {LineAxis::kY, 0, -1, Eigen::Vector3d::UnitY(), 0.001}};
}

std::vector<MapLine> LinesOf(const std::vector<WallRectangle>& rectangles,
                             const std::vector<BuildingAxis>& axes, int views = 11) {
  const Views moving = MovingViews(views);
  const PaintedWall wall(moving, rectangles, kDistance_m);
  return BuildLines(moving, wall, axes, {}, {}, LineSurfaces({}), MapLineOptions());
}

// The largest distance of a line's ends from a place (x, z) of the wall, for a vertical line, or
// from a height, for a level one.
bool IsAlong(const MapLine& line, int across, double place_m) {
  for (const Eigen::Vector3d& p : {line.start_world, line.end_world}) {
    if (std::abs(p(across) - place_m) > 0.01 || std::abs(p.y() - kDistance_m) > 0.02) return false;
  }
  return true;
}

double Length_m(const MapLine& line) { return (line.end_world - line.start_world).norm(); }

TEST(MapLines, TheSidesOfARectangleAreFoundWhereTheyAre) {
  const auto lines = LinesOf({{-0.5, 0.4, -0.3, 0.4}}, WallAxes());
  ASSERT_EQ(lines.size(), 4u);
  for (const auto& [across, place_m, length_m] :
       {std::tuple(0, -0.5, 0.7), {0, 0.4, 0.7}, {2, -0.3, 0.9}, {2, 0.4, 0.9}}) {
    const auto found =
        std::find_if(lines.begin(), lines.end(), [&, a = across, p = place_m](auto& l) {
          return l.axis == (a == 0 ? LineAxis::kVertical : LineAxis::kX) && IsAlong(l, a, p);
        });
    ASSERT_NE(found, lines.end()) << across << " " << place_m;
    EXPECT_NEAR(Length_m(*found), length_m, 0.05);
    EXPECT_GT(found->observations, 5);
    EXPECT_LT(found->sigma_m, 0.02);
    EXPECT_NE(found->kind, LineKind::kMark);
  }
}

TEST(MapLines, ADoorwayIsAGapOfOneLine) {
  const auto lines = LinesOf({{-1.0, -0.3, -0.3, 0.4}, {0.3, 1.0, -0.3, 0.4}}, WallAxes());
  std::vector<const MapLine*> tops;
  for (const MapLine& line : lines) {
    if (line.axis == LineAxis::kX && IsAlong(line, 2, 0.4)) tops.push_back(&line);
  }
  ASSERT_EQ(tops.size(), 2u);
  EXPECT_EQ(tops[0]->id, tops[1]->id);
  for (const MapLine* top : tops) EXPECT_NEAR(Length_m(*top), 0.7, 0.05);
}

TEST(MapLines, JambsSixCentimetresApartStayTwo) {
  const auto lines = LinesOf({{-0.5, -0.2, -0.4, 0.5}, {-0.14, 0.3, -0.4, 0.5}}, WallAxes());
  for (const double place_m : {-0.2, -0.14}) {
    EXPECT_EQ(std::count_if(lines.begin(), lines.end(),
                            [&](const MapLine& l) {
                              return l.axis == LineAxis::kVertical && IsAlong(l, 0, place_m);
                            }),
              1)
        << place_m;
  }
}

TEST(MapLines, ABlankWallHasNone) { EXPECT_TRUE(LinesOf({}, WallAxes()).empty()); }

TEST(MapLines, AreTheSameWithAnyNumberOfThreads) {
  const std::vector<WallRectangle> rectangles = {{-0.5, 0.4, -0.3, 0.4}, {0.6, 0.9, -0.1, 0.2}};
  const auto many = LinesOf(rectangles, WallAxes());
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const auto one = LinesOf(rectangles, WallAxes());
  cv::setNumThreads(threads);
  ASSERT_EQ(one.size(), many.size());
  for (size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].start_world, many[i].start_world);
    EXPECT_EQ(one[i].end_world, many[i].end_world);
  }
}

// Of which some views, from `first` on, show nothing.
class PartlyBlindWall : public PaintedWall {
 public:
  PartlyBlindWall(const Views& views, size_t first)
      : PaintedWall(views, {{-0.5, 0.4, -0.3, 0.4}}, kDistance_m), first_(first) {}

  StereoImage Read(size_t view) const override {
    StereoImage pair = PaintedWall::Read(view);
    if (view >= first_) pair.left = pair.right = cv::Mat(320, 480, CV_8UC1, cv::Scalar(60));
    return pair;
  }

 private:
  const size_t first_;
};

// Of 2 m x 2 m, facing away from the painted wall.
std::vector<DensePoint> Screen(double y_m) {
  std::vector<DensePoint> points;
  for (int x = -25; x <= 25; ++x) {
    for (int z = -25; z <= 25; ++z) {
      points.push_back({{0.04 * x, y_m, 0.04 * z}, -Eigen::Vector3d::UnitY(), 0.01});
    }
  }
  return points;
}

TEST(MapLines, ViewsFromWhichALineIsHiddenDoNotMissIt) {
  Views views = MovingViews(11);
  for (int i = 0; i < 20; ++i) {
    views.push_back(testing::LookingAtWall({-0.2 + 0.02 * i, -1.5, 0}, 200 + i));
  }
  const PartlyBlindWall wall(views, 11);
  const auto lines_with = [&](const SightDepths& sights) {
    return BuildLines(views, wall, WallAxes(), {}, sights, LineSurfaces({}), MapLineOptions());
  };
  EXPECT_TRUE(lines_with({}).empty());
  const SightDepths sights(Screen(-0.7), 0.04, ViewCameras(views, wall.rig()));
  EXPECT_EQ(lines_with(sights).size(), 4u);
}

int VerticalLines(const std::vector<MapLine>& lines) {
  return static_cast<int>(std::count_if(lines.begin(), lines.end(), [](const MapLine& line) {
    return line.axis == LineAxis::kVertical;
  }));
}

// All views on a way along the edges agree on what two of them, taken for one, make in the air.
TEST(MapLines, AreBesideSurfacesWhereViewsAreInOnePlaneWithThem) {
  Views rising;
  for (int i = 0; i < 12; ++i) rising.push_back(testing::LookingAtWall({0, 0, 0.1 * i - 0.5}, i));
  const PaintedWall wall(rising, {{-0.5, 0.4, -0.3, 0.4}}, kDistance_m);
  const auto lines_with = [&](const std::vector<DensePoint>& cloud) {
    return BuildLines(rising, wall, WallAxes(), {}, {}, LineSurfaces(cloud), MapLineOptions());
  };
  const std::vector<MapLine> in_the_air = lines_with({});
  EXPECT_EQ(VerticalLines(in_the_air), 0);
  EXPECT_EQ(in_the_air.size(), 2u);  // the level ones are seen from below and from above
  EXPECT_EQ(VerticalLines(lines_with(Screen(kDistance_m))), 2);
}

TEST(MapLines, EndWithWhatIsFoundOnceProgressSaysSo) {
  const Views views = MovingViews(11);
  const PaintedWall wall(views, {{-0.5, 0.4, -0.3, 0.4}}, kDistance_m);
  const auto lines = BuildLines(views, wall, WallAxes(), {}, {}, LineSurfaces({}), MapLineOptions(),
                                Progress([](double) { return false; }));
  EXPECT_TRUE(lines.empty());
}

}  // namespace
}  // namespace slcmap
