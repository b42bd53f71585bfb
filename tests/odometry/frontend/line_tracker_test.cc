#include "odometry/frontend/line_tracker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <opencv2/core.hpp>

#include "odometry/frontend/line_detector.h"
#include "odometry/frontend/line_matcher.h"
#include "odometry/frontend/line_segment.h"
#include "tests/odometry/frontend/line_test_scene.h"

namespace slcmap {
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

}  // namespace
}  // namespace slcmap
