#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "mapping/lines/line_merging.h"
#include "mapping/lines/options.h"
#include "odometry/frontend/line_segment.h"
#include "tests/mapping/lines/painted_wall.h"

namespace slcmap {
namespace {

using testing::MovingViews;
using testing::PaintedWall;

const MapLineOptions kOptions;
const IntervalLimits kLimits{kOptions.min_views, kOptions.max_sigma_m, kOptions.max_spread_px,
                             kOptions.intervals.min_length_m};
const PointAndDirection kEdge{{0.2, 2, 0.1}, Eigen::Vector3d::UnitZ()};

class LineStretches : public ::testing::Test {
 protected:
  // A line whose places are off its edge by what `off_px` says of a view and a place along it.
  TrackedLine LineWith(const std::function<double(int view, double along_m)>& off_px) const {
    TrackedLine line;
    line.line = kEdge;
    line.intervals = {{-0.5, 0.5}};
    for (int view = 0; view < static_cast<int>(views_.size()); ++view) {
      for (const int camera : {0, 1}) {
        const auto part = SeenPart(kEdge, {-0.5, 0.5}, cameras_.T_camera_world[view][camera],
                                   cameras_.cameras[camera], {});
        if (!part) continue;
        for (double share = 0.05; share < 1; share += 0.1) {
          const double along_m = part->AlongAt(share);
          const Eigen::Vector2d normal = Normal(part->px);
          const Eigen::Vector2d px = part->px.start + share * (part->px.end - part->px.start) +
                                     off_px(view, along_m) * normal;
          line.places.push_back({view, camera, static_cast<float>(along_m), px.cast<float>(),
                                 normal.cast<float>(), 4});
        }
      }
    }
    return line;
  }

  std::optional<LineFit> Fit(TrackedLine* line) const {
    return FitIntervals(cameras_, DirectionPrior{kEdge.direction_world, 0.01}, {}, kLimits, line);
  }

  static double Off_m(const LineFit& fit) {
    return (fit.line.point_world - kEdge.point_world).head<2>().norm();
  }

  const Views views_ = MovingViews(8);
  const PaintedWall wall_{views_, {}, 2};
  const ViewCameras cameras_{views_, wall_.rig()};
};

// As of an edge at another depth, which moves along the line from view to view.
double Passing_px(int view) { return 0.6 * (view - 3.5); }

TEST_F(LineStretches, WhatIsOneEdgeStaysWhole) {
  TrackedLine line = LineWith([](int view, double) { return view % 2 == 0 ? 0.1 : -0.1; });
  const size_t places = line.places.size();
  const auto fit = Fit(&line);
  ASSERT_TRUE(fit);
  EXPECT_LT(Off_m(*fit), 2e-3);
  ASSERT_EQ(line.intervals.size(), 1u);
  EXPECT_EQ(line.intervals[0].from_m, -0.5);
  EXPECT_EQ(line.intervals[0].to_m, 0.5);
  EXPECT_EQ(line.places.size(), places);
}

TEST_F(LineStretches, WhatShowsAnotherEdgeLeaves) {
  TrackedLine line =
      LineWith([](int view, double along_m) { return along_m > 0 ? Passing_px(view) : 0; });
  const auto fit = Fit(&line);
  ASSERT_TRUE(fit);
  EXPECT_LE(fit->spread_px, kLimits.max_spread_px);
  EXPECT_LT(Off_m(*fit), 2e-3);
  ASSERT_EQ(line.intervals.size(), 1u);
  EXPECT_EQ(line.intervals[0].from_m, -0.5);
  EXPECT_NEAR(line.intervals[0].to_m, 0, 1e-9);
  for (const EdgePoint& place : line.places) EXPECT_LT(place.along_m, 0);
}

TEST_F(LineStretches, ALineThatHoldsLosesWhatDoesNot) {
  TrackedLine line =
      LineWith([](int view, double along_m) { return along_m > 0.25 ? Passing_px(view) : 0; });
  ASSERT_TRUE(Fit(&line));
  ASSERT_EQ(line.intervals.size(), 1u);
  EXPECT_NEAR(line.intervals[0].to_m, 0.25, 1e-9);
}

TEST_F(LineStretches, WhatScattersEverywhereIsToldAsItIs) {
  TrackedLine line = LineWith([](int view, double along_m) {
    return std::fmod(7.3 * view + 31 * std::abs(along_m), 3.0) - 1.5;
  });
  const auto fit = Fit(&line);
  ASSERT_TRUE(fit);
  EXPECT_GT(fit->spread_px, kLimits.max_spread_px);
  EXPECT_EQ(line.intervals.size(), 1u);
  EXPECT_EQ(line.intervals[0].to_m, 0.5);
}

}  // namespace
}  // namespace slcmap
