#include "odometry/frontend/line_tracker.h"

#include <gtest/gtest.h>

#include <map>
#include <opencv2/core.hpp>

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

}  // namespace
}  // namespace slcmap
