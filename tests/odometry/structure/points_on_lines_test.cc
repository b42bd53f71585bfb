#include "odometry/structure/points_on_lines.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace slcmap {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr double kDisparity_px = 30;

PointObservation Point(int64_t id, double x, double y, double disparity_px = kDisparity_px) {
  return {id, {x, y}, Eigen::Vector2d(x - disparity_px, y)};
}

LineObservation Line(int64_t id, const Eigen::Vector2d& start, const Eigen::Vector2d& end) {
  const Eigen::Vector2d d(kDisparity_px, 0);
  return {id, {start, end}, LineSegment{start - d, end - d}};
}

const LineObservation kSlanted = Line(7, {100, 100}, {300, 300});
const PointOnLine kPair = {1, 7};

class PointsOnLinesTest : public ::testing::Test {
 protected:
  const std::set<PointOnLine>& Add(const std::vector<PointObservation>& points,
                                   const std::vector<LineObservation>& lines, int keyframes = 1) {
    for (int i = 0; i < keyframes; ++i) points_on_lines_.AddKeyframe(points, lines);
    return points_on_lines_.verified();
  }
  PointsOnLines points_on_lines_;
};

TEST_F(PointsOnLinesTest, VerifiesAfterFourKeyframesInARow) {
  EXPECT_THAT(Add({Point(1, 200.5, 200)}, {kSlanted}, 3), IsEmpty());
  EXPECT_THAT(Add({Point(1, 200.5, 200)}, {kSlanted}), ElementsAre(kPair));
  EXPECT_THAT(points_on_lines_.CollectPoints(7), ElementsAre(1));
}

TEST_F(PointsOnLinesTest, TakesPointsNearTheEndsButNotBeyond) {
  const double near = 300 + 3, far = 300 + 20;
  Add({Point(1, near, near), Point(2, far, far), Point(3, 100 - 3, 100 - 3)}, {kSlanted}, 4);
  EXPECT_THAT(points_on_lines_.CollectPoints(7), ElementsAre(1, 3));
}

TEST_F(PointsOnLinesTest, NeedsBothImages) {
  PointObservation only_left = Point(1, 200, 200);
  only_left.right_px.reset();
  Add({only_left, Point(2, 210, 210, kDisparity_px - 6), Point(3, 210, 214)}, {kSlanted}, 6);
  EXPECT_THAT(points_on_lines_.verified(), IsEmpty());
}

TEST_F(PointsOnLinesTest, KeyframesWithoutOneOfThemDoNotCount) {
  Add({Point(1, 200, 200)}, {kSlanted}, 3);
  Add({}, {kSlanted});
  Add({Point(1, 200, 200)}, {});
  EXPECT_THAT(Add({Point(1, 200, 200)}, {kSlanted}), ElementsAre(kPair));
}

TEST_F(PointsOnLinesTest, AViewApartStartsTheCountAnewAndBreaksAMembership) {
  Add({Point(1, 200, 200)}, {kSlanted}, 3);
  Add({Point(1, 204, 200)}, {kSlanted});
  EXPECT_THAT(Add({Point(1, 200, 200)}, {kSlanted}, 3), IsEmpty());
  EXPECT_THAT(Add({Point(1, 200, 200)}, {kSlanted}), ElementsAre(kPair));
  EXPECT_THAT(Add({Point(1, 250, 200)}, {kSlanted}), IsEmpty());
}

TEST_F(PointsOnLinesTest, SharesAPointOnlyBetweenLinesThatCross) {
  const LineObservation crossing = Line(8, {150, 250}, {250, 150});
  const LineObservation beside = Line(9, {100, 101}, {300, 301});
  Add({Point(1, 200, 200), Point(2, 220, 220.2)}, {kSlanted, crossing, beside}, 4);
  EXPECT_THAT(points_on_lines_.verified(),
              ElementsAre(PointOnLine{1, 7}, PointOnLine{1, 8}, PointOnLine{2, 7}));
}

TEST_F(PointsOnLinesTest, ReleasedPairsDoNotComeBack) {
  Add({Point(1, 200, 200), Point(2, 220, 220)}, {kSlanted}, 4);
  points_on_lines_.Release(kPair);
  Add({Point(1, 200, 200), Point(2, 220, 220)}, {kSlanted}, 5);
  EXPECT_THAT(points_on_lines_.CollectPoints(7), ElementsAre(2));
  points_on_lines_.ReleasePoint(2);
  EXPECT_THAT(points_on_lines_.verified(), IsEmpty());
}

TEST_F(PointsOnLinesTest, ALineTakesOverAnothersPoints) {
  Add({Point(1, 200, 200)}, {kSlanted}, 4);
  points_on_lines_.MergeLine(7, 12);
  EXPECT_THAT(points_on_lines_.verified(), ElementsAre(PointOnLine{1, 12}));
  points_on_lines_.ReleaseLine(12);
  EXPECT_THAT(points_on_lines_.verified(), IsEmpty());
}

TEST_F(PointsOnLinesTest, FindsLongLinesInAllAreas) {
  std::vector<PointObservation> points;
  for (int i = 0; i < 60; ++i) points.push_back(Point(i, 20 + 10 * i, 40 + 3 * i));
  Add(points, {Line(5, {20, 40}, {610, 217})}, 4);
  EXPECT_EQ(points_on_lines_.CollectPoints(5).size(), 60u);
}

}  // namespace
}  // namespace slcmap
