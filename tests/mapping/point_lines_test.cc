#include <gtest/gtest.h>

#include "mapping/map/landmarks.h"

namespace slcmap {
namespace {

MapLine Line(int64_t id, const Eigen::Vector3d& start, const Eigen::Vector3d& end) {
  MapLine line;
  line.id = id;
  line.sigma_m = 0.005;
  line.start_world = start;
  line.end_world = end;
  return line;
}

int64_t LineOf(const Eigen::Vector3d& p, double sigma_m) {
  // The first has a gap of a doorway's width.
  const std::vector<MapLine> lines = {Line(7, {0, 0, 0}, {3, 0, 0}), Line(7, {4, 0, 0}, {5, 0, 0}),
                                      Line(9, {0, 0.03, 0}, {3, 0.03, 0})};
  std::vector<MapPoint> points(1);
  points[0].p_world = p;
  points[0].sigma_m = sigma_m;
  points[0].line_id = 5;
  FindLinesOfPoints(lines, &points);
  return points[0].line_id;
}

TEST(PointLines, APointLiesOnTheNearestLineThatIsNearEnough) {
  EXPECT_EQ(LineOf({1.03, 0.002, 0.004}, 0.005), 7);
  EXPECT_EQ(LineOf({1.03, 0.02, 0}, 0.02), 9);
  EXPECT_EQ(LineOf({1, -0.03, 0}, 0.005), -1) << "too far for what is known of both";
  EXPECT_EQ(LineOf({1, -0.03, 0}, 0.02), 7);
  EXPECT_EQ(LineOf({1, -0.05, 0}, 1), -1) << "too far for anything";
}

TEST(PointLines, NoPointLiesInAGap) {
  EXPECT_EQ(LineOf({3.5, 0, 0}, 0.02), -1);
  EXPECT_EQ(LineOf({4.97, 0, 0}, 0.005), 7);
  EXPECT_EQ(LineOf({5.005, 0, 0}, 0.005), 7) << "at the end";
}

}  // namespace
}  // namespace slcmap
