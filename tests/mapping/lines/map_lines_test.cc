#include "mapping/lines/map_lines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/core/utility.hpp>
#include <stdexcept>

#include "odometry/geometry/pinhole.h"
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

std::vector<MapLine> CollectLines(const std::vector<WallRectangle>& rectangles,
                                  const std::vector<BuildingAxis>& axes, int views = 11) {
  const Views moving = MovingViews(views);
  const PaintedWall wall(moving, rectangles, kDistance_m);
  return BuildLines(moving, wall, axes, {}, {}, LineSurfaces({}), MapLineOptions()).lines;
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
  const auto lines = CollectLines({{-0.5, 0.4, -0.3, 0.4}}, WallAxes());
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

// Left and right images do not tell how far level edges are; views at other heights do.
TEST(MapLines, LevelEdgesTurnedAgainstTheBuildingAreFound) {
  std::vector<BuildingAxis> turned = WallAxes();
  turned[1].direction_world = {std::cos(0.4), std::sin(0.4), 0};
  turned[2].direction_world = {-std::sin(0.4), std::cos(0.4), 0};
  const auto lines = CollectLines({{-0.5, 0.4, -0.3, 0.4}}, turned);
  ASSERT_EQ(lines.size(), 4u);
  for (const double height_m : {-0.3, 0.4}) {
    const auto found = std::find_if(lines.begin(), lines.end(), [&](const MapLine& line) {
      return line.axis == LineAxis::kNone && IsAlong(line, 2, height_m);
    });
    ASSERT_NE(found, lines.end()) << height_m;
    EXPECT_NEAR(Length_m(*found), 0.9, 0.05);
  }
}

std::vector<WallRectangle> Row(double turn_rad) {
  std::vector<WallRectangle> row;
  for (const double left_m : {-1.0, -0.4, 0.2}) {
    row.push_back({left_m, left_m + 0.35, -0.3, 0.2, turn_rad});
  }
  return row;
}

// As chairs in a row, each a little askew: their edges lie along a line, but none of them on it.
TEST(MapLines, ARowOfTurnedThingsIsNoLine) {
  const auto tops = [](double turn_rad) {
    const auto lines = CollectLines(Row(turn_rad), WallAxes());
    return std::count_if(lines.begin(), lines.end(), [](const MapLine& line) {
      return line.axis == LineAxis::kX && std::abs(line.start_world.z() - 0.2) < 0.03;
    });
  };
  EXPECT_EQ(tops(0), 3);
  // By less each top is straight enough for a line along the axis, as far as it reaches.
  EXPECT_EQ(tops(0.04), 0);
  for (const MapLine& line : CollectLines(Row(0.03), WallAxes())) {
    EXPECT_TRUE(line.axis != LineAxis::kX || Length_m(line) < 0.4);
  }
}

TEST(MapLines, ADoorwayIsAGapOfOneLine) {
  const auto lines = CollectLines({{-1.0, -0.3, -0.3, 0.4}, {0.3, 1.0, -0.3, 0.4}}, WallAxes());
  std::vector<const MapLine*> tops;
  for (const MapLine& line : lines) {
    if (line.axis == LineAxis::kX && IsAlong(line, 2, 0.4)) tops.push_back(&line);
  }
  ASSERT_EQ(tops.size(), 2u);
  EXPECT_EQ(tops[0]->id, tops[1]->id);
  for (const MapLine* top : tops) EXPECT_NEAR(Length_m(*top), 0.7, 0.05);
}

// Two rectangles with a doorway between them.
class LineEvidenceTest : public ::testing::Test {
 protected:
  const MapLine& PieceOf(int64_t line_id, int piece) const {
    for (const MapLine& line : built_.lines) {
      if (line.id == line_id && piece-- == 0) return line;
    }
    throw std::logic_error("no such piece");
  }

  // A place of the wall as a support's image has it.
  Eigen::Vector2d Project(const LineSupport& support, const Eigen::Vector3d& p_world) const {
    const View& view = *std::ranges::find(views_, support.stamp_ns, &View::stamp_ns);
    const Eigen::Vector3d p =
        WorldFromCamera(view, wall_.rig(), support.camera).Inverse() * p_world;
    return PixelFromPlane(wall_.rig().cameras[support.camera], Eigen::Vector2d(p.hnormalized()));
  }

  const Views views_ = MovingViews(11);
  const PaintedWall wall_{views_, {{-1.0, -0.3, -0.3, 0.4}, {0.3, 1.0, -0.3, 0.4}}, kDistance_m};
  const LinesOfMap built_ =
      BuildLines(views_, wall_, WallAxes(), {}, {}, LineSurfaces({}), MapLineOptions());
};

TEST_F(LineEvidenceTest, SupportsAreWhereImagesShowThePiece) {
  ASSERT_FALSE(built_.lines.empty());
  std::map<std::pair<int64_t, int>, int> counts;
  for (const LineSupport& support : built_.evidence.supports) {
    const MapLine& line = PieceOf(support.line_id, support.piece);
    const bool is_level = line.axis == LineAxis::kX;
    Eigen::Vector3d on_edge = 0.5 * (line.start_world + line.end_world);  // the true one
    on_edge.y() = kDistance_m;
    if (is_level) on_edge.z() = on_edge.z() > 0 ? 0.4 : -0.3;
    if (!is_level) on_edge.x() = std::copysign(std::abs(on_edge.x()) > 0.6 ? 1 : 0.3, on_edge.x());
    const int across = is_level ? 1 : 0;
    for (const Eigen::Vector2d& px : {support.px.start, support.px.end}) {
      EXPECT_NEAR(px(across), Project(support, on_edge)(across), 0.35);
    }
    // In the direction of the piece, and not across the doorway, of which 90 px are seen.
    const Eigen::Vector2d along =
        Project(support, line.end_world) - Project(support, line.start_world);
    EXPECT_GT(along.dot(support.px.end - support.px.start), 0);
    EXPECT_LT(support.px.Length(), along.norm() + 3);
    ++counts[{support.line_id, support.piece}];
  }
  EXPECT_EQ(counts.size(), built_.lines.size());
  for (const auto& [piece, count] : counts) EXPECT_GT(count, 10);
}

TEST_F(LineEvidenceTest, CovariancesSayWhatEndsMayBeOffAcross) {
  ASSERT_EQ(built_.evidence.covariances.size(), built_.lines.size());
  for (const LineCovariance& covariance : built_.evidence.covariances) {
    const MapLine& line = PieceOf(covariance.line_id, covariance.piece);
    const Eigen::Vector3d along = (line.end_world - line.start_world).normalized();
    EXPECT_LT((covariance.start_m2 * along).norm(), 1e-9);
    // The displacement of places between the ends is what those of the ends say, and least near
    // the places of the line that were seen: there it is what the line's sigma tells, and what
    // places and views share.
    double least_m2 = 1e9;
    for (int i = -50; i <= 60; ++i) {
      const double t = 0.1 * i;
      const Eigen::Matrix3d cross = covariance.start_end_m2 + covariance.start_end_m2.transpose();
      const Eigen::Matrix3d at =
          (1 - t) * (1 - t) * covariance.start_m2 + t * t * covariance.end_m2 + t * (1 - t) * cross;
      least_m2 = std::min(least_m2, at.selfadjointView<Eigen::Upper>().eigenvalues().maxCoeff());
    }
    const double shared_m = LineFitOptions().shared_sigma_m;
    EXPECT_GT(std::sqrt(least_m2), std::hypot(shared_m, line.sigma_m));
    EXPECT_LT(std::sqrt(least_m2), std::hypot(shared_m, 3 * line.sigma_m));
  }
}

// A level line half a metre long, two metres before the first view, with places so far below it.
class MadeEvidenceTest : public ::testing::Test {
 protected:
  MadeEvidenceTest() {
    line_.line = {{-0.5, kDistance_m, 0}, Eigen::Vector3d::UnitX()};
    line_.intervals = {{0, 0.5}};
    line_.fit.across.setZero();
    line_.fit.world_covariance.setZero();
  }

  void AddPlace(double along_m, const Interval& stretch, double below_px) {
    // 150 pixels are a metre.
    const Eigen::Vector2d px(239.5 + 150 * along_m, 159.5 + below_px);
    line_.places.push_back({0,
                            0,
                            static_cast<float>(along_m),
                            px.cast<float>(),
                            {0, 1},
                            4,
                            static_cast<float>(stretch.from_m),
                            static_cast<float>(stretch.to_m)});
  }

  std::vector<LineSupport> Supports() const {
    const PaintedWall wall(views_, {}, kDistance_m);
    return CollectEvidence({line_}, views_, ViewCameras(views_, wall.rig())).supports;
  }

  const Views views_ = MovingViews(1);
  TrackedLine line_;
};

TEST_F(MadeEvidenceTest, ASupportGoesThroughItsPlaces) {
  AddPlace(0.1, {0, 0.2}, 0.5);
  AddPlace(0.4, {0.3, 0.48}, -0.7);
  const auto supports = Supports();
  ASSERT_EQ(supports.size(), 1u);
  EXPECT_LT((supports[0].px.start - Eigen::Vector2d(239.5, 159.5 + 0.9)).norm(), 1e-5);
  EXPECT_LT((supports[0].px.end - Eigen::Vector2d(239.5 + 72, 159.5 - 1.02)).norm(), 1e-5);
}

TEST_F(MadeEvidenceTest, PlacesNearEachOtherDoNotTurnALongSegment) {
  AddPlace(0.24, {0, 0.24}, 0.3);
  AddPlace(0.26, {0.26, 0.5}, -0.3);
  const auto supports = Supports();
  ASSERT_EQ(supports.size(), 1u);
  EXPECT_NEAR(supports[0].px.start.y(), 159.5, 1e-6);
  EXPECT_NEAR(supports[0].px.end.y(), 159.5, 1e-6);
}

TEST_F(MadeEvidenceTest, SupportsEndAtTheBorderOfTheImage) {
  line_.intervals = {{0, 2}};
  AddPlace(1.3, {1, 1.9}, 0);
  const auto supports = Supports();
  ASSERT_EQ(supports.size(), 1u);
  EXPECT_NEAR(supports[0].px.start.x(), 389.5, 1e-6);
  EXPECT_NEAR(supports[0].px.end.x(), 479.5, 1e-6);  // the image is 480 pixels wide
}

TEST_F(MadeEvidenceTest, WhatIsShortOrFarBesideTheLineIsLeftOut) {
  AddPlace(0.1, {0, 0.2}, 2.5);
  EXPECT_TRUE(Supports().empty());
  line_.places.clear();
  AddPlace(0.1, {0.095, 0.105}, 0);
  EXPECT_TRUE(Supports().empty());
  line_.places.clear();
  AddPlace(0.1, {0, 0.2}, 0);
  line_.places.back().samples = 1;
  EXPECT_TRUE(Supports().empty());
}

TEST(MapLines, JambsSixCentimetresApartStayTwo) {
  const auto lines = CollectLines({{-0.5, -0.2, -0.4, 0.5}, {-0.14, 0.3, -0.4, 0.5}}, WallAxes());
  for (const double place_m : {-0.2, -0.14}) {
    EXPECT_EQ(std::count_if(lines.begin(), lines.end(),
                            [&](const MapLine& l) {
                              return l.axis == LineAxis::kVertical && IsAlong(l, 0, place_m);
                            }),
              1)
        << place_m;
  }
}

TEST(MapLines, ABlankWallHasNone) { EXPECT_TRUE(CollectLines({}, WallAxes()).empty()); }

TEST(MapLines, AreTheSameWithAnyNumberOfThreads) {
  const std::vector<WallRectangle> rectangles = {{-0.5, 0.4, -0.3, 0.4}, {0.6, 0.9, -0.1, 0.2}};
  const auto many = CollectLines(rectangles, WallAxes());
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const auto one = CollectLines(rectangles, WallAxes());
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
  const auto lines_with = [&](const VisibilityDepths& depths) {
    return BuildLines(views, wall, WallAxes(), {}, depths, LineSurfaces({}), MapLineOptions())
        .lines;
  };
  EXPECT_TRUE(lines_with({}).empty());
  const VisibilityDepths depths(Screen(-0.7), 0.04, ViewCameras(views, wall.rig()));
  EXPECT_EQ(lines_with(depths).size(), 4u);
}

int VerticalLines(const std::vector<MapLine>& lines) {
  return static_cast<int>(std::count_if(lines.begin(), lines.end(), [](const MapLine& line) {
    return line.axis == LineAxis::kVertical;
  }));
}

// No view sees the edges from aside, but nothing else explains what these show.
TEST(MapLines, AreFoundWhereViewsAreInOnePlaneWithThem) {
  Views rising;
  for (int i = 0; i < 12; ++i) rising.push_back(testing::LookingAtWall({0, 0, 0.1 * i - 0.5}, i));
  const PaintedWall wall(rising, {{-0.5, 0.4, -0.3, 0.4}}, kDistance_m);
  for (const auto& cloud : {std::vector<DensePoint>(), Screen(kDistance_m)}) {
    const std::vector<MapLine> lines =
        BuildLines(rising, wall, WallAxes(), {}, {}, LineSurfaces(cloud), MapLineOptions()).lines;
    EXPECT_EQ(lines.size(), 4u);
    EXPECT_EQ(VerticalLines(lines), 2);
    for (const MapLine& line : lines) EXPECT_NEAR(line.start_world.y(), kDistance_m, 0.02);
  }
}

TEST(MapLines, EndWithWhatIsFoundOnceProgressSaysSo) {
  const Views views = MovingViews(11);
  const PaintedWall wall(views, {{-0.5, 0.4, -0.3, 0.4}}, kDistance_m);
  const auto built = BuildLines(views, wall, WallAxes(), {}, {}, LineSurfaces({}), MapLineOptions(),
                                Progress([](double) { return false; }));
  EXPECT_TRUE(built.lines.empty());
  EXPECT_TRUE(built.evidence.covariances.empty() && built.evidence.supports.empty());
}

}  // namespace
}  // namespace slcmap
