#include "mapping/lines/line_merging.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "mapping/lines/line_fit.h"
#include "mapping/lines/map_lines.h"
#include "mapping/lines/options.h"
#include "odometry/frontend/line_segment.h"
#include "tests/mapping/lines/painted_wall.h"

namespace slcmap {
namespace {

using testing::MovingViews;
using testing::PaintedWall;

// A line along x whose bins are shown and missed as often as the pairs say, two centimetres each.
TrackedLine WithBins(const std::vector<std::pair<int, BinViews>>& stretches) {
  TrackedLine line;
  line.line = {Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX()};
  for (const auto& [count, bin] : stretches) line.bins.insert(line.bins.end(), count, bin);
  return line;
}

constexpr BinViews kShown{8, 1}, kMissed{1, 8}, kUnseen{0, 0};

TEST(LineIntervals, AreWhatEnoughViewsShowWithoutLongGaps) {
  const auto count = [](const std::vector<std::pair<int, BinViews>>& stretches) {
    return FindIntervals(WithBins(stretches)).size();
  };
  EXPECT_EQ(count({{20, kShown}, {4, kUnseen}, {20, kShown}}), 1u);
  EXPECT_EQ(count({{20, kShown}, {4, kMissed}, {20, kShown}}), 2u);
  EXPECT_EQ(count({{20, kShown}, {9, kUnseen}, {20, kShown}}), 2u);
  // What hides an edge from some views is not always known: nearly half of them are enough.
  EXPECT_EQ(count({{50, {5, 6}}}), 1u);
  EXPECT_EQ(count({{50, {5, 10}}}), 0u);
  EXPECT_EQ(count({{50, {2, 0}}}), 0u) << "few views";
  EXPECT_EQ(count({{2, kShown}, {50, kMissed}}), 0u) << "short";
}

TrackedLine At(double y_m, double from_m, double to_m, double sigma_m, int views = 10) {
  TrackedLine line;
  line.axis = 1;
  line.line = {{0, y_m, 0}, Eigen::Vector3d::UnitX()};
  line.intervals = {{from_m, to_m}};
  line.fit.across = ComputeAcross(line.line.direction_world);
  line.fit.covariance = Eigen::Matrix4d::Identity() * sigma_m * sigma_m;
  line.fit.covariance.bottomRightCorner<2, 2>() *= 0.01;
  line.fit.views = views;
  return line;
}

TEST(LineMerging, TakesOneEdgeTogether) {
  const auto merged = MergeLines({At(0, 0, 1, 0.005), At(0.008, 0.9, 2, 0.005)});
  ASSERT_EQ(merged.size(), 1u);
  ASSERT_EQ(merged[0].intervals.size(), 1u);
  EXPECT_NEAR(merged[0].intervals[0].to_m - merged[0].intervals[0].from_m, 2, 1e-6);
}

// Edges are known far better across the view than along it.
TEST(LineMerging, ComparesInTheDirectionOfWhatEdgesAreApart) {
  const auto lines = [](const Eigen::Vector3d& off) {
    std::vector<TrackedLine> two = {At(0, 0, 1, 0.0005), At(0, 0, 1, 0.0005, 9)};
    two[1].line.point_world += off;
    for (TrackedLine& line : two) {
      const Eigen::Vector2d depth = line.fit.across.transpose() * Eigen::Vector3d::UnitY();
      line.fit.covariance.topLeftCorner<2, 2>() += 64e-6 * depth * depth.transpose();
    }
    return MergeLines(two).size();
  };
  EXPECT_EQ(lines({0, 0.02, 0}), 1u);
  EXPECT_EQ(lines({0, 0, 0.02}), 2u);
}

TEST(LineMerging, DoesNotChain) {
  // Each fits its neighbour, the first and the last do not fit each other.
  const auto merged =
      MergeLines({At(0, 0, 1, 0.006), At(0.02, 0, 1, 0.006, 9), At(0.04, 0, 1, 0.006, 8)});
  EXPECT_EQ(merged.size(), 2u);
}

EdgePoint PlaceAt(int view, double from_m, double to_m) {
  EdgePoint place;
  place.view = view;
  place.along_m = static_cast<float>(0.5 * (from_m + to_m));
  place.from_m = static_cast<float>(from_m);
  place.to_m = static_cast<float>(to_m);
  return place;
}

// What supports the other supports the edge, but where an image shows both.
TEST(LineMerging, PlacesOfTheOtherAreTakenWhereTheLineHasNone) {
  TrackedLine line = At(0, 0, 1, 0.005), other = At(0.008, 0, 1, 0.005, 5);
  other.line = {{1, 0.008, 0}, -Eigen::Vector3d::UnitX()};
  line.places = {PlaceAt(0, 0, 0.25)};
  other.places = {PlaceAt(0, 0.8, 1), PlaceAt(0, 0.2, 0.4), PlaceAt(3, 0.8, 1)};
  const auto merged = MergeLines({line, other});
  ASSERT_EQ(merged.size(), 1u);
  ASSERT_EQ(merged[0].places.size(), 3u);
  EXPECT_NEAR(merged[0].places[1].from_m, 0.6, 1e-7);
  EXPECT_NEAR(merged[0].places[1].to_m, 0.8, 1e-7);
  EXPECT_NEAR(merged[0].places[1].along_m, 0.7, 1e-7);
  EXPECT_EQ(merged[0].places[2].view, 3);
}

// From afar a place is a single sample: those of two edges lie between each other.
TEST(LineMerging, OfTwoEdgesSeenFromAfarOneKeepsItsPlaces) {
  const auto with_places = [](double y_m, double first_m, int views) {
    TrackedLine line = At(y_m, 0, 1, 0.005, views);
    std::vector<LineSample> samples(10);
    for (size_t i = 0; i < samples.size(); ++i) {
      samples[i].along_m = first_m + 0.1 * static_cast<double>(i);
      samples[i].reach_m = 0.05;
      samples[i].is_edge = true;
    }
    AddPlaces(samples, {.px = {{0, 0}, {100, 0}}}, 0, 0, 0.06, &line.places);
    return line;
  };
  const auto merged = MergeLines({with_places(0, 0.05, 10), with_places(0.008, 0.09, 5)});
  ASSERT_EQ(merged.size(), 1u);
  EXPECT_EQ(merged[0].places.size(), 10u);
}

// Where a line's error is known to turn about a place before it, it is the larger beyond.
TEST(LineMerging, KnowsALineBestWhereItsErrorsMeet) {
  TrackedLine line = At(0, 0, 1, 0.002);
  line.fit.covariance.bottomRightCorner<2, 2>() = 1e-4 * Eigen::Matrix2d::Identity();
  line.fit.covariance.topRightCorner<2, 2>() = 1.9e-5 * Eigen::Matrix2d::Identity();
  line.fit.covariance.bottomLeftCorner<2, 2>() = 1.9e-5 * Eigen::Matrix2d::Identity();
  const auto merges = [&](double y_m, double from_m, double to_m) {
    return MergeLines({line, At(y_m, from_m, to_m, 0.001, 1)}).size() == 1;
  };
  EXPECT_TRUE(merges(0.017, 0.4, 0.5));     // met at 0.45: a sigma of 6.4 mm
  EXPECT_FALSE(merges(0.009, -0.6, -0.5));  // met at -0.25: 0.9 mm
}

const MapLineOptions kOptions;
const IntervalLimits kLimits{kOptions.min_views, kOptions.max_sigma_m, kOptions.max_spread_px,
                             0.1};  // metres
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
  const ViewCameras cameras_{views_, PaintedWall(views_).rig()};
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

// Whether the line would hold with it or not.
TEST_F(LineStretches, WhatShowsAnotherEdgeLeaves) {
  for (const double from_m : {0.0, 0.25}) {
    SCOPED_TRACE(from_m);
    TrackedLine line =
        LineWith([&](int view, double along_m) { return along_m > from_m ? Passing_px(view) : 0; });
    const auto fit = Fit(&line);
    ASSERT_TRUE(fit);
    EXPECT_LE(fit->spread_px, kLimits.max_spread_px);
    EXPECT_LT(Off_m(*fit), 2e-3);
    ASSERT_EQ(line.intervals.size(), 1u);
    EXPECT_EQ(line.intervals[0].from_m, -0.5);
    EXPECT_NEAR(line.intervals[0].to_m, from_m, 1e-9);
    for (const EdgePoint& place : line.places) EXPECT_LE(place.along_m, from_m);
  }
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
