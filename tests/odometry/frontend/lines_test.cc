// A picture of known straight edges.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <opencv2/core.hpp>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "data/core/types.h"
#include "odometry/frontend/line_detector.h"
#include "odometry/frontend/line_matcher.h"
#include "odometry/frontend/line_segment.h"
#include "odometry/frontend/line_tracker.h"
#include "tests/testing/pinhole_camera.h"

namespace slcmap {
namespace testing {

Rig LineTestRig() {
  Rig rig;
  rig.cameras.assign(2, PinholeCamera(600, 400, 400, 299.5, 199.5));
  rig.T_imu_camera[1].translation = {0.1, 0, 0};
  return rig;
}

// A bright or dark bar with soft edges, as a lens makes them.
struct Bar {
  LineSegment axis;
  double half_width_px = 6;
  double brightness = 80;  // above its surroundings
};

// Several bars on a grey picture with an uneven ground, moved by `shift`.
cv::Mat DrawBars(const std::vector<Bar>& bars, const Eigen::Vector2d& shift = {0, 0},
                 double noise = 1) {
  cv::Mat image(400, 600, CV_8UC1);
  cv::RNG rng(3);
  const auto step = [](double d) { return 0.5 * (1 + std::erf(d / (0.8 * std::sqrt(2)))); };
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      const Eigen::Vector2d p = Eigen::Vector2d(u, v) - shift;
      double value = 90 + 0.02 * p.x() + 0.03 * p.y() + rng.gaussian(noise);
      for (const auto& bar : bars) {
        const Eigen::Vector2d d = (bar.axis.end - bar.axis.start).normalized();
        const Eigen::Vector2d q = p - bar.axis.start;
        const double across = std::abs(d.x() * q.y() - d.y() * q.x());
        const double along = d.dot(q);
        value += bar.brightness * step(bar.half_width_px - across) * step(along) *
                 step((bar.axis.end - bar.axis.start).norm() - along);
      }
      image.at<uchar>(v, u) = cv::saturate_cast<uchar>(value);
    }
  }
  return image;
}

std::vector<Bar> TestBars() {
  return {{{{80, 60}, {90, 330}}, 6, 80},    {{{150, 300}, {330, 320}}, 5, -50},
          {{{200, 60}, {420, 90}}, 9, 60},   {{{300, 130}, {310, 280}}, 12, -40},
          {{{450, 350}, {520, 120}}, 7, 90}, {{{380, 180}, {430, 230}}, 5, 50}};
}

// The long edges of the bars: two each.
std::vector<LineSegment> EdgesOf(const std::vector<Bar>& bars,
                                 const Eigen::Vector2d& shift = {0, 0}) {
  std::vector<LineSegment> edges;
  for (const auto& bar : bars) {
    const Eigen::Vector2d d = (bar.axis.end - bar.axis.start).normalized();
    for (const double side : {-bar.half_width_px, bar.half_width_px}) {
      const Eigen::Vector2d offset = shift + side * Eigen::Vector2d(-d.y(), d.x());
      edges.push_back({bar.axis.start + offset, bar.axis.end + offset});
    }
  }
  return edges;
}

// The nearest edge's index, and the larger distance of the segment's ends from it.
std::pair<int, double> NearestEdge(const std::vector<LineSegment>& edges,
                                   const LineSegment& segment) {
  std::pair<int, double> best{-1, 1e9};
  for (size_t i = 0; i < edges.size(); ++i) {
    const Eigen::Vector2d d = (edges[i].end - edges[i].start).normalized();
    const auto distance = [&](const Eigen::Vector2d& p) {
      const Eigen::Vector2d q = p - edges[i].start;
      const double beyond = std::max({0.0, -d.dot(q) - 3, d.dot(q) - edges[i].Length() - 3});
      return std::abs(d.x() * q.y() - d.y() * q.x()) + beyond;
    };
    const double largest = std::max(distance(segment.start), distance(segment.end));
    if (largest < best.second) best = {static_cast<int>(i), largest};
  }
  return best;
}

}  // namespace testing

namespace {

using testing::DrawBars;
using testing::EdgesOf;
using testing::LineTestRig;
using testing::NearestEdge;
using testing::TestBars;

const Eigen::Quaterniond kNoTurn = Eigen::Quaterniond::Identity();

class LineTrackerTest : public ::testing::Test {
 protected:
  // The whole scene shifted, at one disparity.
  void Track(const Eigen::Vector2d& shift, const std::vector<LinePrediction>& predictions = {}) {
    tracker_.Track(DrawBars(bars_, shift), DrawBars(bars_, shift - Eigen::Vector2d(12.4, 0)),
                   kNoTurn, predictions, {});
  }
  // Which edge each line is on, by id.
  std::map<int64_t, int> EdgeOfId(const Eigen::Vector2d& shift) const {
    std::map<int64_t, int> edges;
    for (const auto& o : tracker_.observations()) {
      const auto [edge, distance] = NearestEdge(EdgesOf(bars_, shift), o.left_px);
      EXPECT_LT(distance, 0.3);
      edges[o.id] = edge;
    }
    return edges;
  }

  std::vector<testing::Bar> bars_ = TestBars();
  cv::Mat mask_{400, 600, CV_8UC1, cv::Scalar(255)};
  LineTracker tracker_{LineTrackerOptions(), LineTestRig(), mask_, mask_};
};

TEST_F(LineTrackerTest, FollowsEdgesWithoutPredictions) {
  Track({0, 0});
  const auto first = EdgeOfId({0, 0});
  EXPECT_GE(first.size(), 11u);
  for (int i = 1; i <= 4; ++i) Track({5.3 * i, -3.7 * i});
  const auto last = EdgeOfId({21.2, -14.8});
  int same = 0;
  for (const auto& [id, edge] : last) {
    if (!first.contains(id)) continue;
    EXPECT_EQ(edge, first.at(id));
    ++same;
  }
  EXPECT_GE(same, 10);
}

TEST_F(LineTrackerTest, FindsTheRightSegments) {
  Track({0, 0});
  int found = 0;
  for (const auto& o : tracker_.observations()) {
    if (!o.right_px) continue;
    ++found;
    const auto left = NearestEdge(EdgesOf(bars_), o.left_px);
    const auto right = NearestEdge(EdgesOf(bars_, {-12.4, 0}), *o.right_px);
    EXPECT_EQ(left.first, right.first);
    EXPECT_LT(right.second, 0.3);
  }
  EXPECT_GE(found, 10);
}

TEST_F(LineTrackerTest, FindsALostLineAgainByItsPrediction) {
  Track({0, 0});
  const auto first = EdgeOfId({0, 0});
  const cv::Mat flat(400, 600, CV_8UC1, cv::Scalar(90));
  std::vector<LinePrediction> predictions;
  for (const auto& o : tracker_.observations()) predictions.push_back({o.id, o.left_px, {}, 1});
  for (int i = 0; i < 8; ++i) {
    tracker_.Track(flat, flat, kNoTurn, predictions, {});
    EXPECT_TRUE(tracker_.observations().empty());
  }
  Track({0.8, 1.1}, predictions);
  EXPECT_EQ(EdgeOfId({0.8, 1.1}), first);
}

TEST_F(LineTrackerTest, ForgetsWhatIsRemovedAndNeverReusesIds) {
  Track({0, 0});
  const auto first = EdgeOfId({0, 0});
  const int64_t removed = tracker_.observations()[2].id;
  tracker_.Remove({removed});
  EXPECT_EQ(tracker_.observations().size(), first.size() - 1);
  Track({1, 0});
  for (const auto& o : tracker_.observations()) EXPECT_NE(o.id, removed);
  tracker_.Reset();
  EXPECT_TRUE(tracker_.observations().empty());
  Track({2, 0});
  for (const auto& o : tracker_.observations()) EXPECT_FALSE(first.contains(o.id));
}

TEST_F(LineTrackerTest, SurvivesBlankImagesAndOneCamera) {
  const cv::Mat black(400, 600, CV_8UC1, cv::Scalar(0));
  tracker_.Track(black, black, kNoTurn, {}, {});
  EXPECT_TRUE(tracker_.observations().empty());
  tracker_.Track(DrawBars(bars_), {}, kNoTurn, {}, {});
  EXPECT_GE(tracker_.observations().size(), 11u);
  for (const auto& o : tracker_.observations()) EXPECT_FALSE(o.right_px);
}

const Eigen::Vector2d kShift(7.2, -4.4);

class LineMatcherTest : public ::testing::Test {
 protected:
  std::vector<LineSegment> Detect(const cv::Mat& image) const {
    return DetectSegments(image, {}, LineDetectorOptions());
  }
  std::vector<ExpectedSegment> Expect(double gate_px) const {
    std::vector<ExpectedSegment> expected;
    const cv::Mat descriptors = DescribeSegments(first_, segments_);
    for (size_t i = 0; i < segments_.size(); ++i) {
      expected.push_back({segments_[i], MeanProfile(first_, segments_[i]),
                          descriptors.row(static_cast<int>(i)), gate_px, gate_px, 0.1});
    }
    return expected;
  }

  cv::Mat first_ = DrawBars(TestBars()), moved_ = DrawBars(TestBars(), kShift);
  std::vector<LineSegment> segments_ = Detect(first_);
};

TEST_F(LineMatcherTest, MatchesWhatMovedWithinTheGateOnly) {
  const auto moved = Detect(moved_);
  int right = 0;
  const auto matches = MatchExpected(moved_, Expect(30), moved);
  for (size_t i = 0; i < matches.size(); ++i) {
    if (!matches[i]) continue;
    EXPECT_EQ(NearestEdge(EdgesOf(TestBars()), segments_[i]).first,
              NearestEdge(EdgesOf(TestBars(), kShift), moved[*matches[i]]).first);
    ++right;
  }
  EXPECT_GE(right, 10);
  for (const auto& match : MatchExpected(moved_, Expect(1.0), moved)) {
    EXPECT_FALSE(match);
  }
}

TEST_F(LineMatcherTest, RefusesOtherProfilesWhateverTheDescriptor) {
  std::vector<ExpectedSegment> expected = Expect(30);
  for (auto& e : expected) e.profile.reverseInPlace();
  for (const auto& match : MatchExpected(first_, expected, segments_)) {
    EXPECT_FALSE(match);
  }
}

TEST_F(LineMatcherTest, StereoRefusesNegativeDisparitiesOfSteepEdges) {
  const auto match = [&](const Eigen::Vector2d& shift) {
    const cv::Mat right = DrawBars(TestBars(), shift);
    return MatchStereo(first_, right, segments_, Detect(right));
  };
  int found = 0;
  for (const auto& m : match({-15, 0})) found += m.has_value();
  EXPECT_GE(found, 10);
  const auto negative = match({15, 0});
  for (size_t i = 0; i < segments_.size(); ++i) {
    // Those along the rows don't tell.
    if (std::abs(Direction(segments_[i]).y()) > 0.2) {
      EXPECT_FALSE(negative[i]);
    }
  }
}

TEST_F(LineMatcherTest, FollowsAnEdgeToWhereItsProfileIs) {
  for (const auto& s : segments_) {
    const auto found = FollowEdge(moved_, s, MeanProfile(first_, s), 9, 0.85);
    if (!found) continue;
    const LineSegment there{s.start + kShift, s.end + kShift};
    EXPECT_LT(LargestDistance_px(there, *found), 0.2);
  }
  const auto& s = segments_.front();
  // The other side of a bar looks like this one reversed, but is beyond the gate.
  EXPECT_FALSE(FollowEdge(first_, Reversed(s), MeanProfile(first_, s), 5, 0.85));
}

TEST(LineSelectionTest, PrefersTheAxesAndSpreads) {
  const Camera camera = testing::LineTestRig().cameras[0];
  const std::vector<Eigen::Vector3d> axes = {{0, 1, 0}};
  const LineSegment upright{{100, 100}, {100, 200}}, beside{{104, 100}, {104, 200}},
      oblique{{200, 100}, {280, 180}}, far_upright{{500, 100}, {500, 180}};
  EXPECT_EQ(FindAxis(upright, camera, axes), 0);
  EXPECT_EQ(FindAxis(oblique, camera, axes), -1);
  EXPECT_EQ(SelectSegments({oblique, beside, upright, far_upright}, {}, camera, axes, 3),
            (std::vector<int>{1, 3, 0}));
  EXPECT_TRUE(SelectSegments({oblique}, {}, camera, axes, 0).empty());
}

class LineDetectorTest : public ::testing::TestWithParam<LineDetectorKind> {
 protected:
  static std::vector<LineSegment> Detect(const cv::Mat& image, const cv::Mat& mask = {}) {
    LineDetectorOptions options;
    options.kind = GetParam();
    return DetectSegments(image, mask, options);
  }
};

TEST_P(LineDetectorTest, FindsEachEdgeOnceToATenthOfAPixel) {
  const cv::Mat image = DrawBars(TestBars());
  std::set<int> seen;
  for (const auto& s : Detect(image)) {
    const auto [edge, distance] = NearestEdge(EdgesOf(TestBars()), s);
    EXPECT_LT(distance, 0.15);
    EXPECT_TRUE(seen.insert(edge).second) << "edge " << edge << " twice";
    EXPECT_GT(MeanContrast(image, s), 20) << "the bright side is on the left";
  }
  EXPECT_GE(seen.size(), 11u);
}

TEST_P(LineDetectorTest, LeavesOutWhatTheMaskHides) {
  cv::Mat mask(400, 600, CV_8UC1, cv::Scalar(255));
  mask.colRange(0, 300) = 0;
  const auto segments = Detect(DrawBars(TestBars()), mask);
  EXPECT_GE(segments.size(), 3u);
  for (const auto& s : segments) EXPECT_GT(std::min(s.start.x(), s.end.x()), 299);
}

// The longest edges are those that leave the image on both sides.
TEST_P(LineDetectorTest, CutsEdgesAtTheBorderOfTheMask) {
  cv::Mat image(400, 600, CV_8UC1, cv::Scalar(60));
  image.colRange(301, 600) = 160;
  cv::Mat mask(400, 600, CV_8UC1, cv::Scalar(0));
  mask(cv::Range(8, 392), cv::Range(8, 592)) = 255;
  const auto segments = Detect(image, mask);
  ASSERT_EQ(segments.size(), 1u);
  EXPECT_GT(segments[0].Length(), 340);
  EXPECT_GE(std::min(segments[0].start.y(), segments[0].end.y()), 7.5);
  EXPECT_LE(std::max(segments[0].start.y(), segments[0].end.y()), 391.5);
}

TEST_P(LineDetectorTest, FindsNothingInAFlatImage) {
  EXPECT_TRUE(Detect(cv::Mat(400, 600, CV_8UC1, cv::Scalar(90))).empty());
}

INSTANTIATE_TEST_SUITE_P(Kinds, LineDetectorTest,
                         ::testing::Values(LineDetectorKind::kLsd, LineDetectorKind::kFld,
                                           LineDetectorKind::kEd));

// The size of the smaller image is rounded; the scale is not.
TEST(LineDetectorScaleTest, PlacesEdgesOfASmallerImageInTheWholeOne) {
  const cv::Mat image = DrawBars(TestBars())(cv::Rect(0, 0, 599, 399)).clone();
  for (const double scale : {1.0, 0.7, 0.5}) {
    LineDetectorOptions options;
    options.scale = scale;
    double length_px = 0;
    const auto segments = DetectSegments(image, {}, options);
    for (const auto& s : segments) {
      EXPECT_LT(NearestEdge(EdgesOf(TestBars()), s).second, 0.15) << "scale " << scale;
      length_px += s.Length();
    }
    EXPECT_GE(segments.size(), 11u) << "scale " << scale;
    EXPECT_GT(length_px / static_cast<double>(segments.size()), 150) << "scale " << scale;
    double raw_px = 0;
    for (const auto& s : DetectRawSegments(image, options, 60)) {
      raw_px = std::max(raw_px, NearestEdge(EdgesOf(TestBars()), s).second);
    }
    EXPECT_LT(raw_px, 0.9 / scale) << "scale " << scale;
  }
}

TEST(JoinSegmentsTest, JoinsPiecesOfOneEdgeAndNoOthers) {
  const std::vector<LineSegment> pieces = {{{10, 50}, {60, 50}},
                                           {{70, 50.3}, {120, 50.2}},  // goes on
                                           {{20, 54}, {100, 54}},      // beside it
                                           {{120, 50}, {10, 50}},      // of the other polarity
                                           {{300, 50}, {350, 50}},     // far along
                                           {{125, 50}, {160, 58}}};    // bent
  const auto joined = JoinSegments(pieces, 30);
  EXPECT_EQ(joined.size(), 5u);
  EXPECT_NEAR(joined.front().Length(), 110, 0.5);
}

TEST(RefineSegmentTest, PlacesATiltedGuessOnTheEdgeAndExtendsIt) {
  const auto bars = TestBars();
  const cv::Mat image = DrawBars(bars);
  LineSegment edge = EdgesOf(bars)[4];
  if (MeanContrast(image, edge) < 0) edge = Reversed(edge);
  const Eigen::Vector2d d = Direction(edge), n = Normal(edge);
  const LineSegment guess{edge.start + 60 * d + 1.5 * n, edge.end - 60 * d - 1.0 * n};
  LineRefinementOptions options;
  options.max_extension_px = 100;
  const auto refined = RefineSegment(image, guess, options);
  ASSERT_TRUE(refined);
  EXPECT_LT(LargestDistance_px(edge, refined->segment), 0.1);
  EXPECT_NEAR(refined->segment.Length(), edge.Length(), 10);
  EXPECT_FALSE(RefineSegment(image, Reversed(guess), options)) << "the other polarity";
  EXPECT_FALSE(RefineSegment(image, {guess.start + 30 * n, guess.end + 30 * n}, options));
}

constexpr double kBlur_px = 1, kSlope = 3, kStep = 10;

// Brightness at a distance from an edge: a step, and a slope behind it, blurred.
double Brightness(double distance_px, double step, double slope) {
  const double u = distance_px / kBlur_px;
  const double share = 0.5 * std::erfc(-u / std::numbers::sqrt2);
  const double density = std::exp(-0.5 * u * u) / std::sqrt(2 * std::numbers::pi);
  return 100 + step * share + slope * (distance_px * share + kBlur_px * density);
}

std::vector<EdgeProfile> Profiles(const std::function<double(double)>& brightness, int count,
                                  double noise) {
  std::mt19937 generator(3);
  std::normal_distribution<double> normal(0, noise);
  std::vector<EdgeProfile> profiles(static_cast<size_t>(count));
  for (EdgeProfile& profile : profiles) {
    for (int i = -kEdgeReach; i <= kEdgeReach; ++i) {
      profile[static_cast<size_t>(i + kEdgeReach)] =
          brightness(i) + (noise > 0 ? normal(generator) : 0);
    }
  }
  return profiles;
}

TEST(EdgeShading, FindsHowFarASlopeMovesTheSteepestPlace) {
  // Of differences over two pixels, which blur by a third more.
  constexpr double kShift_px = kSlope * (kBlur_px * kBlur_px + 1.0 / 3) / kStep;
  const auto as_found = [](double x) { return Brightness(x + kShift_px, kStep, kSlope); };
  EXPECT_NEAR(ShadingShift_px(Profiles(as_found, 20, 0)), kShift_px, 0.3 * kShift_px);
  EXPECT_NEAR(ShadingShift_px(Profiles(as_found, 40, 0.5)), kShift_px, 0.5 * kShift_px);
  const auto mirrored = [](double x) { return -Brightness(kShift_px - x, kStep, kSlope); };
  EXPECT_NEAR(ShadingShift_px(Profiles(mirrored, 20, 0)), -kShift_px, 0.3 * kShift_px);
}

TEST(EdgeShading, IsZeroWhereNothingTellsOfASlope) {
  const auto step = [](double x) { return Brightness(x, kStep, 0); };
  EXPECT_NEAR(ShadingShift_px(Profiles(step, 20, 0)), 0, 0.01);
  EXPECT_NEAR(ShadingShift_px(Profiles(step, 20, 2)), 0, 0.1) << "noise";
  const auto neighbour = [](double x) {
    return Brightness(x, kStep, 0) + 40 / (1 + std::exp(-4 * (x - 3.5)));
  };
  EXPECT_NEAR(ShadingShift_px(Profiles(neighbour, 20, 0)), 0, 0.2) << "another edge";
  const auto flat = [](double) { return 7.0; };
  EXPECT_EQ(ShadingShift_px(Profiles(flat, 20, 0)), 0);
  EXPECT_EQ(ShadingShift_px({}), 0);
}

// An edge through the image whose slope grows along it, as that of one that recedes.
TEST(EdgeShading, RefinedSegmentsLieOnTheEdgeBesideFadingLight) {
  constexpr double kY_px = 60.3, kTilt = 0.04;
  cv::Mat image(120, 300, CV_8UC1);
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      const double distance_px = (v - kY_px - kTilt * (u - 150)) / std::hypot(1, kTilt);
      const double value = Brightness(distance_px, kStep, 0.5 + 2 * u / 300.0) - 40;
      image.at<uchar>(v, u) = cv::saturate_cast<uchar>(value);
    }
  }
  LineSegment edge{{20, kY_px - kTilt * 130}, {280, kY_px + kTilt * 130}};
  if (MeanContrast(image, edge) < 0) edge = Reversed(edge);
  const auto refined = RefineSegment(image, edge, {});
  ASSERT_TRUE(refined);
  EXPECT_LT(LargestDistance_px(edge, refined->segment), 0.1);  // 0.25 with the steepest places
}

}  // namespace
}  // namespace slcmap
