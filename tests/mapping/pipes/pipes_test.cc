#include "mapping/pipes/pipes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "mapping/map/point_index.h"
#include "mapping/pipes/outlines.h"
#include "mapping/pipes/pipe_likelihood.h"
#include "tests/mapping/pipes/scene_of_views.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::kHalf_m;
using testing::kViews;
using testing::SceneOfViews;
using testing::Way;

// What views see of a pipe: outlines that move over it.
SceneOfViews PipeOf(double radius_m, double turn_rad) {
  SceneOfViews scene(turn_rad);
  const double touching_rad = std::acos(radius_m / 2);
  for (const double side : {-1.0, 1.0}) {
    const int line = scene.AddLine(radius_m * Way(side * touching_rad));
    for (int view = 0; view < kViews; ++view) {
      const Vector2d centre = scene.Centre(view);
      const double angle_rad = std::atan2(centre.y(), centre.x());
      scene.AddSupport(line, view, radius_m * Way(angle_rad + side * touching_rad));
    }
  }
  for (double angle_rad = -1.2; angle_rad < 1.2; angle_rad += 0.1) {
    scene.AddPoints(radius_m * Way(angle_rad), Way(angle_rad));
  }
  return scene;
}

// A line at each place in all views, or only in those whose view of it `shows` says so.
void AddEdges(
    const std::vector<Vector2d>& places, SceneOfViews* scene,
    const std::function<bool(const Vector2d&, int)>& shows = [](const auto&, int) {
      return true;
    }) {
  for (const Vector2d& place : places) {
    const int line = scene->AddLine(place);
    for (int view = 0; view < kViews; ++view) {
      if (shows(place, view)) scene->AddSupport(line, view, place);
    }
  }
}

SceneOfViews PanelOf(double width_m, double turn_rad) {
  SceneOfViews scene(turn_rad);
  AddEdges({{0, -width_m / 2}, {0, width_m / 2}}, &scene);
  for (double y_m = -0.45 * width_m; y_m < 0.46 * width_m; y_m += 0.1 * width_m) {
    scene.AddPoints({0, y_m}, {1, 0});
  }
  return scene;
}

// Only its outermost corners are outlines of a post.
SceneOfViews SquarePostOf(double side_m, double turn_rad) {
  SceneOfViews scene(turn_rad);
  const double h_m = side_m / 2;
  const std::vector<Vector2d> corners = {{h_m, h_m}, {h_m, -h_m}, {-h_m, h_m}, {-h_m, -h_m}};
  AddEdges(corners, &scene, [&](const Vector2d& corner, int view) {
    const auto angle = [&](const Vector2d& p) {
      const Vector2d centre = scene.Centre(view), way = p - centre;
      return std::atan2(centre.x() * way.y() - centre.y() * way.x(), -centre.dot(way));
    };
    const auto [least, most] = std::ranges::minmax(corners, {}, angle);
    return angle(corner) < angle(least) + 1e-9 || angle(corner) > angle(most) - 1e-9;
  });
  for (double y_m = -0.9 * h_m; y_m < h_m; y_m += 0.2 * h_m) {
    scene.AddPoints({h_m, y_m}, {1, 0});
    scene.AddPoints({y_m, h_m}, {0, 1});
    scene.AddPoints({y_m, -h_m}, {0, -1});
  }
  return scene;
}

// Seen corner on, two sides of it slope away as the front of a pipe does.
SceneOfViews PostCornerOn(double side_m, double turn_rad) {
  SceneOfViews scene(turn_rad);
  const double d_m = side_m / std::sqrt(2.0);
  AddEdges({{0, d_m}, {0, -d_m}, {d_m, 0}}, &scene);
  for (double share = 0.05; share < 1; share += 0.1) {
    for (const double side : {-1.0, 1.0}) {
      scene.AddPoints({(1 - share) * d_m, side * share * d_m}, Way(side * M_PI / 4));
    }
  }
  return scene;
}

TEST(Pipes, AreFoundByOutlinesThatMove) {
  for (const double radius_m : {0.04, 0.06, 0.1, 0.18}) {
    const FoundPipes found = FindPipes(PipeOf(radius_m, 1.4).map(), {});
    ASSERT_EQ(found.pipes.size(), 1u) << radius_m;
    const MapPipe& pipe = found.pipes[0];
    EXPECT_NEAR(pipe.radius_m, radius_m, 1e-4);
    EXPECT_LT(pipe.start_world.head<2>().norm(), 1e-3);
    EXPECT_NEAR((pipe.end_world - pipe.start_world).norm(), 2 * kHalf_m, 1e-3);
    EXPECT_EQ(pipe.axis, LineAxis::kVertical);
    EXPECT_EQ(pipe.images, kViews);
    EXPECT_EQ(found.line_ids, (std::vector<int64_t>{0, 1}));
  }
}

TEST(Pipes, WhatIsFlatOrSquareIsNone) {
  struct Thing {
    const char* what;
    SceneOfViews (*make)(double size_m, double turn_rad);
    std::vector<double> sizes_m, turns_rad;
  };
  for (const Thing& thing : std::vector<Thing>{
           {"panels", PanelOf, {0.08, 0.2, 0.4}, {0.1, 0.5, 1.4}},
           {"square posts", SquarePostOf, {0.08, 0.12, 0.3}, {0.1, 1.0, 2.5}},
           {"square posts corner on", PostCornerOn, {0.1, 0.15, 0.3}, {0.1, 0.6}},
           // Views from one side alone do not tell the outlines of a pipe from those of a bar.
           {"pipes from one side", PipeOf, {0.05, 0.1}, {0.1}}}) {
    for (const double size_m : thing.sizes_m) {
      for (const double turn_rad : thing.turns_rad) {
        EXPECT_TRUE(FindPipes(thing.make(size_m, turn_rad).map(), {}).pipes.empty())
            << thing.what << " " << size_m << " " << turn_rad;
      }
    }
  }
  // Edges with nothing between them, as of a door frame.
  SceneOfViews frame = PanelOf(0.2, 1.4);
  for (DensePoint& point : frame.map().dense) point.p_world.x() -= 1;
  EXPECT_TRUE(FindPipes(frame.map(), {}).pipes.empty());
}

// As joints of bricks are, whose depth images hardly know: the front of a pipe between them would
// be nearer to the wall than the plane through both.
TEST(Pipes, LinesOnAWallAreNoneWhereImagesHaveThemBehindIt) {
  SceneOfViews scene(0.1);
  AddEdges({{-0.03, -0.04}, {-0.03, 0.04}}, &scene);
  for (double y_m = -0.15; y_m < 0.15; y_m += 0.01) scene.AddPoints({0, y_m}, {1, 0});
  const MapResult& map = scene.map();
  const std::vector<Outline> outlines = CollectOutlines(map);
  ASSERT_EQ(outlines.size(), 2u);
  const std::vector<const Outline*> both = {&outlines[0], &outlines[1]};
  const auto fit = FitPipe({{-0.03, 0, 0}, Vector3d::UnitZ()}, both);
  ASSERT_TRUE(fit);
  const PointTree index(map.dense);
  EXPECT_LT(ComputePipeLogRatio(fit->cylinder, {-kHalf_m, kHalf_m}, both, {map.dense, index}), -10);
}

// Where other views show other outlines of it, a pipe goes on.
TEST(Pipes, GoOnAsFarAsLinesOnTheirSurfaceDo) {
  SceneOfViews scene = PipeOf(0.06, 1.4);
  const auto add = [&](const Vector2d& place, double from_m, double to_m) {
    MapLine line = scene.map().lines.front();
    line.id = static_cast<int64_t>(scene.map().lines.size());
    line.start_world = {place.x(), place.y(), from_m};
    line.end_world = {place.x(), place.y(), to_m};
    scene.map().lines.push_back(line);
    scene.AddSupport(static_cast<int>(line.id), 0, place);
    return line.id;
  };
  // Where the rays of the first view, at -0.7 rad, touch it.
  const Vector2d left = 0.06 * Way(-0.7 + std::acos(0.03));
  const Vector2d right = 0.06 * Way(-0.7 - std::acos(0.03));
  const int64_t further = add(left, 0.8, 2.5), next = add(right, 2.7, 4);
  add(right, 5.8, 7);          // beyond a gap
  add(0.12 * Way(0.3), 0, 3);  // beside it
  // On it, but no outline, since it is seen in front of the axis: a seam, which makes it no longer.
  const int64_t seam = add(0.06 * Way(-0.7), 2, 5);
  const FoundPipes found = FindPipes(scene.map(), {});
  ASSERT_EQ(found.pipes.size(), 1u);
  const MapPipe& pipe = found.pipes[0];
  EXPECT_NEAR(std::max(pipe.start_world.z(), pipe.end_world.z()), 4, 0.01);
  EXPECT_NEAR(std::min(pipe.start_world.z(), pipe.end_world.z()), -kHalf_m, 0.01);
  EXPECT_EQ(found.line_ids, (std::vector<int64_t>{0, 1, further, next, seam}));
  PipeOptions options;
  options.min_length_m = 6;  // longer than its own outlines
  EXPECT_TRUE(FindPipes(scene.map(), options).pipes.empty());
}

TEST(Pipes, WhatTheyExplainLeavesTheLinesUnlessThatIsOff) {
  SceneOfViews scene = PipeOf(0.06, 1.4);
  // A seam on the pipe, and an edge beside it.
  AddEdges({{0.06, 0}, {0.2, 0.3}}, &scene);
  MapResult& map = scene.map();
  PipeOptions off;
  off.find = false;
  AddPipes(off, {}, &map);
  EXPECT_TRUE(map.pipes.empty());
  EXPECT_EQ(map.lines.size(), 4u);
  AddPipes({}, {}, &map);
  ASSERT_EQ(map.pipes.size(), 1u);
  ASSERT_EQ(map.lines.size(), 1u);
  EXPECT_EQ(map.lines[0].id, 3);
  ASSERT_EQ(map.line_evidence.covariances.size(), 1u);
  EXPECT_EQ(map.line_evidence.supports.size(), static_cast<size_t>(kViews));
  for (const LineSupport& support : map.line_evidence.supports) EXPECT_EQ(support.line_id, 3);
}

}  // namespace
}  // namespace slcmap
