#include "odometry/frontend/line_matcher.h"

#include <gtest/gtest.h>

#include <cmath>

#include "odometry/frontend/line_detector.h"
#include "odometry/frontend/line_segment.h"
#include "odometry/frontend/line_tracker.h"
#include "tests/odometry/frontend/line_test_scene.h"

namespace slcmap {
namespace {

using testing::DrawBars;
using testing::EdgesOf;
using testing::NearestEdge;
using testing::TestBars;

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

TEST_F(LineMatcherTest, DescriptorsAreOfTheSegmentInTheSameRow) {
  const auto moved = Detect(moved_);
  const cv::Mat a = DescribeSegments(first_, segments_), b = DescribeSegments(moved_, moved);
  ASSERT_EQ(a.rows, static_cast<int>(segments_.size()));
  ASSERT_EQ(a.cols, 32);
  for (size_t i = 0; i < segments_.size(); ++i) {
    const int edge = NearestEdge(EdgesOf(TestBars()), segments_[i]).first;
    for (size_t j = 0; j < moved.size(); ++j) {
      if (NearestEdge(EdgesOf(TestBars(), kShift), moved[j]).first != edge) continue;
      EXPECT_LT(DescriptorDistance(a.row(i), b.row(j)), LineMatcherOptions().max_descriptor_bits);
    }
  }
  EXPECT_TRUE(DescribeSegments(first_, {}).empty());
}

TEST_F(LineMatcherTest, MatchesWhatMovedWithinTheGateOnly) {
  const auto moved = Detect(moved_);
  int right = 0;
  const auto matches = MatchExpected(moved_, Expect(30), moved, LineMatcherOptions());
  for (size_t i = 0; i < matches.size(); ++i) {
    if (!matches[i]) continue;
    EXPECT_EQ(NearestEdge(EdgesOf(TestBars()), segments_[i]).first,
              NearestEdge(EdgesOf(TestBars(), kShift), moved[*matches[i]]).first);
    ++right;
  }
  EXPECT_GE(right, 10);
  for (const auto& match : MatchExpected(moved_, Expect(1.0), moved, LineMatcherOptions())) {
    EXPECT_FALSE(match);
  }
}

TEST_F(LineMatcherTest, RefusesOtherProfilesWhateverTheDescriptor) {
  std::vector<ExpectedSegment> expected = Expect(30);
  for (auto& e : expected) e.profile.reverseInPlace();
  for (const auto& match : MatchExpected(first_, expected, segments_, LineMatcherOptions())) {
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
