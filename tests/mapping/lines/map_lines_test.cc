#include "mapping/lines/map_lines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "odometry/geometry/pinhole.h"
#include "tests/mapping/lines/painted_wall.h"

namespace slcmap {
namespace {

using testing::kWallDistance_m;
using testing::MovingViews;
using testing::PaintedWall;
using testing::WallRectangle;

constexpr WallRectangle kRectangle{-0.5, 0.4, -0.3, 0.4};

std::vector<BuildingAxis> WallAxes() {
  return {{LineAxis::kVertical, -1, -1, Eigen::Vector3d::UnitZ(), 0.001},
          {LineAxis::kX, 0, -1, Eigen::Vector3d::UnitX(), 0.001},
          {LineAxis::kY, 0, -1, Eigen::Vector3d::UnitY(), 0.001}};
}

LinesOfMap Build(const Views& views, const PaintedWall& wall,
                 const std::vector<BuildingAxis>& axes = WallAxes(),
                 const VisibilityDepths& depths = {}, const std::vector<DensePoint>& cloud = {},
                 const Progress& progress = {}) {
  return BuildLines(views, wall, axes, {}, depths, LineSurfaces(cloud), MapLineOptions(), progress);
}

std::vector<MapLine> CollectLines(const std::vector<WallRectangle>& rectangles,
                                  const std::vector<BuildingAxis>& axes = WallAxes()) {
  const Views moving = MovingViews(11);
  return Build(moving, PaintedWall(moving, rectangles), axes).lines;
}

double Length_m(const MapLine& line) { return (line.end_world - line.start_world).norm(); }

// Those along the wall at a place of it: an x, of vertical ones, or a height.
std::vector<MapLine> LinesAt(const std::vector<MapLine>& lines, LineAxis axis, double place_m) {
  const int across = axis == LineAxis::kVertical ? 0 : 2;
  const auto is_there = [&](const Eigen::Vector3d& p) {
    return std::abs(p(across) - place_m) < 0.01 && std::abs(p.y() - kWallDistance_m) < 0.02;
  };
  std::vector<MapLine> found;
  for (const MapLine& line : lines) {
    if (line.axis == axis && is_there(line.start_world) && is_there(line.end_world)) {
      found.push_back(line);
    }
  }
  return found;
}

TEST(MapLines, TheSidesOfARectangleAreFoundWhereTheyAre) {
  const auto lines = CollectLines({kRectangle});
  ASSERT_EQ(lines.size(), 4u);
  for (const auto& [axis, place_m, length_m] : {std::tuple(LineAxis::kVertical, -0.5, 0.7),
                                                {LineAxis::kVertical, 0.4, 0.7},
                                                {LineAxis::kX, -0.3, 0.9},
                                                {LineAxis::kX, 0.4, 0.9}}) {
    const auto found = LinesAt(lines, axis, place_m);
    ASSERT_EQ(found.size(), 1u) << place_m;
    EXPECT_NEAR(Length_m(found[0]), length_m, 0.05);
    EXPECT_GT(found[0].observations, 5);
    EXPECT_LT(found[0].sigma_m, 0.02);
    EXPECT_NE(found[0].kind, LineKind::kMark);
  }
}

// Left and right images do not tell how far level edges are; views at other heights do.
TEST(MapLines, LevelEdgesTurnedAgainstTheBuildingAreFound) {
  std::vector<BuildingAxis> turned = WallAxes();
  turned[1].direction_world = {std::cos(0.4), std::sin(0.4), 0};
  turned[2].direction_world = {-std::sin(0.4), std::cos(0.4), 0};
  const auto lines = CollectLines({kRectangle}, turned);
  ASSERT_EQ(lines.size(), 4u);
  for (const double height_m : {-0.3, 0.4}) {
    const auto found = LinesAt(lines, LineAxis::kNone, height_m);
    ASSERT_EQ(found.size(), 1u) << height_m;
    EXPECT_NEAR(Length_m(found[0]), 0.9, 0.05);
  }
}

// As chairs in a row, each a little askew: their edges lie along a line, but none of them on it.
TEST(MapLines, ARowOfTurnedThingsIsNoLine) {
  const auto lines_of_row = [](double turn_rad) {
    std::vector<WallRectangle> row;
    for (const double left_m : {-1.0, -0.4, 0.2}) {
      row.push_back({left_m, left_m + 0.35, -0.3, 0.2, turn_rad});
    }
    return CollectLines(row);
  };
  const auto tops = [&](double turn_rad) {
    const auto lines = lines_of_row(turn_rad);
    return std::count_if(lines.begin(), lines.end(), [](const MapLine& line) {
      return line.axis == LineAxis::kX && std::abs(line.start_world.z() - 0.2) < 0.03;
    });
  };
  EXPECT_EQ(tops(0), 3);
  // By less each top is straight enough for a line along the axis, as far as it reaches.
  EXPECT_EQ(tops(0.04), 0);
  for (const MapLine& line : lines_of_row(0.03)) {
    EXPECT_TRUE(line.axis != LineAxis::kX || Length_m(line) < 0.4);
  }
}

TEST(MapLines, JambsSixCentimetresApartStayTwo) {
  const auto lines = CollectLines({{-0.5, -0.2, -0.4, 0.5}, {-0.14, 0.3, -0.4, 0.5}});
  for (const double place_m : {-0.2, -0.14}) {
    EXPECT_EQ(LinesAt(lines, LineAxis::kVertical, place_m).size(), 1u) << place_m;
  }
}

// Two rectangles with a doorway between them.
class LineEvidenceTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { built_ = Build(views_, wall_); }

  static const MapLine& PieceOf(int64_t line_id, int piece) {
    const auto first = std::ranges::find(built_.lines, line_id, &MapLine::id);
    return *(first + piece);
  }

  // A place of the wall as a support's image has it.
  static Eigen::Vector2d Project(const LineSupport& support, const Eigen::Vector3d& p_world) {
    const View& view = *std::ranges::find(views_, support.stamp_ns, &View::stamp_ns);
    const RigidTransform T_world_camera = WorldFromCamera(view, wall_.rig(), support.camera);
    return *wall_.rig().cameras[support.camera].Project(T_world_camera.Inverse() * p_world);
  }

  static inline const Views views_ = MovingViews(11);
  static inline const PaintedWall wall_{views_, {{-1.0, -0.3, -0.3, 0.4}, {0.3, 1.0, -0.3, 0.4}}};
  static inline LinesOfMap built_;
};

TEST_F(LineEvidenceTest, ADoorwayIsAGapOfOneLine) {
  const auto tops = LinesAt(built_.lines, LineAxis::kX, 0.4);
  ASSERT_EQ(tops.size(), 2u);
  EXPECT_EQ(tops[0].id, tops[1].id);
  for (const MapLine& top : tops) EXPECT_NEAR(Length_m(top), 0.7, 0.05);
}

TEST_F(LineEvidenceTest, SupportsAreWhereImagesShowThePiece) {
  ASSERT_FALSE(built_.lines.empty());
  std::map<std::pair<int64_t, int>, int> counts;
  for (const LineSupport& support : built_.evidence.supports) {
    const MapLine& line = PieceOf(support.line_id, support.piece);
    const bool is_level = line.axis == LineAxis::kX;
    Eigen::Vector3d on_edge = 0.5 * (line.start_world + line.end_world);  // the true one
    on_edge.y() = kWallDistance_m;
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
    // Between the ends it is what those of the ends say, and least near the places that were seen:
    // there it is what the line's sigma tells, and what places and views share.
    const Eigen::Matrix3d cross = covariance.start_end_m2 + covariance.start_end_m2.transpose();
    double least_m2 = 1e9;
    for (double t = -5; t < 6.05; t += 0.1) {
      const Eigen::Matrix3d at =
          (1 - t) * (1 - t) * covariance.start_m2 + t * t * covariance.end_m2 + t * (1 - t) * cross;
      least_m2 = std::min(least_m2, at.selfadjointView<Eigen::Upper>().eigenvalues().maxCoeff());
    }
    const double shared_m = LineFitOptions().shared_sigma_m;
    EXPECT_GT(std::sqrt(least_m2), std::hypot(shared_m, line.sigma_m));
    EXPECT_LT(std::sqrt(least_m2), std::hypot(shared_m, 3 * line.sigma_m));
  }
}

// Of a place along a line, the stretch that it stands for, and how far below the line it is.
struct MadePlace {
  double along_m, from_m, to_m;
  double below_px;
  int samples = 4;
};

// What images support of a level line two metres before the first view, from 239.5, 159.5 on, where
// 150 pixels are a metre.
std::vector<LineSupport> SupportsOf(double length_m, const std::vector<MadePlace>& places) {
  const Views views = MovingViews(1);
  TrackedLine line;
  line.line = {{-0.5, kWallDistance_m, 0}, Eigen::Vector3d::UnitX()};
  line.intervals = {{0, length_m}};
  line.fit.across.setZero();
  line.fit.world_covariance.setZero();
  for (const MadePlace& p : places) {
    const Eigen::Vector2d px(239.5 + 150 * p.along_m, 159.5 + p.below_px);
    line.places.push_back({.along_m = static_cast<float>(p.along_m),
                           .px = px.cast<float>(),
                           .normal = {0, 1},
                           .samples = p.samples,
                           .from_m = static_cast<float>(p.from_m),
                           .to_m = static_cast<float>(p.to_m)});
  }
  return CollectEvidence({line}, views, ViewCameras(views, PaintedWall(views).rig())).supports;
}

TEST(MadeEvidence, ASupportGoesThroughItsPlaces) {
  struct Row {
    const char* what;
    double length_m;
    std::vector<MadePlace> places;
    Eigen::Vector2d start_px, end_px;  // from where the line starts
  };
  for (const Row& row : std::vector<Row>{
           {"two", 0.5, {{0.1, 0, 0.2, 0.5}, {0.4, 0.3, 0.48, -0.7}}, {0, 0.9}, {72, -1.02}},
           {"so near each other that they do not turn it",
            0.5,
            {{0.24, 0, 0.24, 0.3}, {0.26, 0.26, 0.5, -0.3}},
            {0, 0},
            {75, 0}},
           {"beyond the border of the image, 480 pixels wide",
            2,
            {{1.3, 1, 1.9, 0}},
            {150, 0},
            {240, 0}}}) {
    SCOPED_TRACE(row.what);
    const auto supports = SupportsOf(row.length_m, row.places);
    ASSERT_EQ(supports.size(), 1u);
    const Eigen::Vector2d start_px(239.5, 159.5);
    EXPECT_LT((supports[0].px.start - start_px - row.start_px).norm(), 1e-5);
    EXPECT_LT((supports[0].px.end - start_px - row.end_px).norm(), 1e-5);
  }
}

TEST(MadeEvidence, WhatIsShortOrFarBesideTheLineIsLeftOut) {
  EXPECT_FALSE(SupportsOf(0.5, {{0.1, 0, 0.2, 0}}).empty());
  EXPECT_TRUE(SupportsOf(0.5, {{0.1, 0, 0.2, 2.5}}).empty());
  EXPECT_TRUE(SupportsOf(0.5, {{0.1, 0.095, 0.105, 0}}).empty());
  EXPECT_TRUE(SupportsOf(0.5, {{0.1, 0, 0.2, 0, 1}}).empty()) << "a single sample";
}

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
  Views views = MovingViews(6);
  for (int i = 0; i < 10; ++i) {
    views.push_back(testing::LookingAtWall({-0.2 + 0.04 * i, -1.5, 0}, 200 + i));
  }
  const PaintedWall wall(views, {kRectangle}, 6);
  EXPECT_TRUE(Build(views, wall).lines.empty());
  const VisibilityDepths depths(Screen(-0.7), 0.04, ViewCameras(views, wall.rig()));
  EXPECT_EQ(Build(views, wall, WallAxes(), depths).lines.size(), 4u);
}

// No view sees the edges from aside, but nothing else explains what these show.
TEST(MapLines, AreFoundWhereViewsAreInOnePlaneWithThem) {
  Views rising;
  for (int i = 0; i < 9; ++i) rising.push_back(testing::LookingAtWall({0, 0, 0.12 * i - 0.5}, i));
  const PaintedWall wall(rising, {kRectangle});
  for (const auto& cloud : {std::vector<DensePoint>(), Screen(kWallDistance_m)}) {
    const std::vector<MapLine> lines = Build(rising, wall, WallAxes(), {}, cloud).lines;
    EXPECT_EQ(lines.size(), 4u);
    EXPECT_EQ(std::ranges::count(lines, LineAxis::kVertical, &MapLine::axis), 2);
    for (const MapLine& line : lines) EXPECT_NEAR(line.start_world.y(), kWallDistance_m, 0.02);
  }
}

TEST(MapLines, EndWithWhatIsFoundOnceProgressSaysSo) {
  const Views views = MovingViews(11);
  const auto built = Build(views, PaintedWall(views, {kRectangle}), WallAxes(), {}, {},
                           Progress([](double) { return false; }));
  EXPECT_TRUE(built.lines.empty());
  EXPECT_TRUE(built.evidence.covariances.empty() && built.evidence.supports.empty());
}

}  // namespace
}  // namespace slcmap
