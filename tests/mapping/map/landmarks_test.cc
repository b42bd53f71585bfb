#include "mapping/map/landmarks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <cmath>
#include <limits>
#include <random>

#include "data/core/error.h"
#include "mapping/map/point_index.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::ElementsAre;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Points all over a square metre.
std::vector<MapPoint> MakeSquare(int count) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<MapPoint> points;
  for (int i = 0; i < count; ++i) {
    points.push_back({{uniform(random), uniform(random), 2}, 0.1, 3, {i}});
  }
  return points;
}

TEST(PointCloud, UncertainRareAndNonFiniteLandmarksAreLeftOut) {
  CloudOptions options;
  options.max_sigma_m = 0.1;
  options.min_observations = 3;
  const std::vector<Landmark> selected = SelectLandmarks({{1, 0, {1, 2, 3}, 0.05, 3},
                                                          {2, 0, {1, 2, 3}, 0.11, 3},
                                                          {3, 0, {1, 2, 3}, 0.05, 2},
                                                          {4, 0, {1, kNaN, 3}, 0.05, 3},
                                                          {5, 0, {1, 2, 3}, kNaN, 3}},
                                                         options);
  ASSERT_EQ(selected.size(), 1u);
  EXPECT_EQ(selected[0].id, 1);
}

TEST(PointCloud, SegmentsAreKeptApart) {
  CloudOptions options;
  options.voxel_m = 1;
  const std::vector<MapPoint> points = FuseLandmarks(
      {{1, 1, {0.2, 0, 0}, 0.1, 3}, {2, 0, {0.4, 0, 0}, 0.1, 3}, {3, 1, {0.6, 0, 0}, 0.1, 3}},
      options);
  ASSERT_EQ(points.size(), 2u);
  EXPECT_THAT(points[0].landmark_ids, ElementsAre(2));
  EXPECT_THAT(points[1].landmark_ids, ElementsAre(1, 3));
}

TEST(PointCloud, LandmarksOfAVoxelAreWeightedByTheirCertainty) {
  CloudOptions options;
  options.voxel_m = 1;
  const std::vector<MapPoint> points = FuseLandmarks(
      {{7, 0, {0.2, 0, 0}, 0.1, 3}, {8, 0, {0.7, 0, 0}, 0.2, 4}, {9, 0, {-0.1, 0, 0}, 0.2, 5}},
      options);
  ASSERT_EQ(points.size(), 2u);
  EXPECT_THAT(points[0].landmark_ids, ElementsAre(9));
  EXPECT_THAT(points[1].landmark_ids, ElementsAre(7, 8));
  EXPECT_NEAR(points[1].p_world.x(), 0.8 * 0.2 + 0.2 * 0.7, 1e-12);
  EXPECT_NEAR(points[1].sigma_m, 1 / std::sqrt(125), 1e-12);
  EXPECT_EQ(points[1].observations, 7);
}

TEST(PointCloud, FarPointsDoNotOverflowTheGridAndZeroSigmaIsNoDivision) {
  const std::vector<MapPoint> points =
      FuseLandmarks({{1, 0, {-1e6, 2e6, 3e5}, 0, 3}, {2, 0, {1e6, 0, 0}, 0.1, 3}}, CloudOptions());
  ASSERT_EQ(points.size(), 2u);
  EXPECT_LT((points[0].p_world - Eigen::Vector3d(-1e6, 2e6, 3e5)).norm(), 1e-6);
  EXPECT_TRUE(std::isfinite(points[0].sigma_m));
}

TEST(PointCloud, OutliersAreRemovedWhereThereIsTimeAndPointsAreMany) {
  std::vector<MapPoint> points = MakeSquare(300);
  points.insert(points.begin() + 100, MapPoint{{5, 5, 5}, 0.1, 3, {1000}});
  const std::vector<MapPoint> inliers = RemoveOutliers(points, CloudOptions());
  EXPECT_GT(inliers.size(), 290u);
  for (const MapPoint& point : inliers) EXPECT_NE(point.landmark_ids[0], 1000);
  const Progress stop([](double) { return false; });
  EXPECT_EQ(RemoveOutliers(points, CloudOptions(), stop).size(), 301u);
  EXPECT_TRUE(FuseLandmarks({{1, 0, {1, 2, 3}, 0.1, 3}}, CloudOptions(), stop).empty());
  for (const size_t count : {0, 1, 2, 12}) {
    EXPECT_EQ(RemoveOutliers(MakeSquare(static_cast<int>(count)), CloudOptions()).size(), count);
  }
}

// One step from neighbour to neighbour, but for the last point, which is three from its own.
TEST(PointCloud, TheLimitOfOutliersIsSoManyStandardDeviationsAboveTheMean) {
  std::vector<MapPoint> points;
  for (int i = 0; i < 9; ++i) points.push_back({{1.0 * i, 0, 0}, 0.1, 3, {i}});
  points.push_back({{11, 0, 0}, 0.1, 3, {9}});
  CloudOptions options;
  options.outlier_neighbours = 1;
  // Mean 1.2, standard deviation sqrt(3.6 / 9): the last is 2.85 of them above.
  options.outlier_sigmas = 2.84;
  EXPECT_EQ(RemoveOutliers(points, options).size(), 9u);
  options.outlier_sigmas = 2.85;
  EXPECT_EQ(RemoveOutliers(points, options).size(), 10u);
}

TEST(PointCloud, PclReadsThePcdFile) {
  const testing::TempFolder folder;
  const std::string path = folder.Path("a.pcd");
  WritePcd(path, {{{1.5, -2.25, 3}, 0.125, 4, {}}, {{100.25, 0, -7}, 0.5, 9, {}}});
  pcl::PointCloud<pcl::PointXYZ> cloud;
  ASSERT_EQ(pcl::io::loadPCDFile(path, cloud), 0);
  ASSERT_EQ(cloud.size(), 2u);
  EXPECT_EQ(cloud[0].getVector3fMap(), Eigen::Vector3f(1.5, -2.25, 3));
  EXPECT_EQ(cloud[1].getVector3fMap(), Eigen::Vector3f(100.25, 0, -7));
  pcl::PCLPointCloud2 fields;
  ASSERT_EQ(pcl::io::loadPCDFile(path, fields), 0);
  EXPECT_EQ(fields.fields[3].name, "sigma_m");
  EXPECT_EQ(fields.at<float>(1, 12), 0.5f);
  EXPECT_EQ(fields.at<int32_t>(1, 16), 9);
  WritePcd(path, {});
  ASSERT_GE(pcl::PCDReader().readHeader(path, fields), 0);
  EXPECT_EQ(fields.width * fields.height, 0u);
  EXPECT_THROW(WritePcd("/dev/full", MakeSquare(10)), OutputError);
}

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
  EXPECT_EQ(LineOf({3.5, 0, 0}, 0.02), -1) << "in a gap";
  EXPECT_EQ(LineOf({4.97, 0, 0}, 0.005), 7);
  EXPECT_EQ(LineOf({5.005, 0, 0}, 0.005), 7) << "at the end";
}

DensePoint At(double x_m, double y_m) {
  DensePoint point;
  point.p_world = {x_m, y_m, 1};
  return point;
}

TEST(PointTree, FindsWhatIsWithinTheRadiusTheNearestFirst) {
  const PointTree tree(std::vector<DensePoint>{At(0.3, 0), At(5, 5), At(0.1, 0), At(0, -0.2)});
  PointTree::Found found{{7}, {}};
  tree.FindWithin({0, 0, 1}, 0.25, &found);
  EXPECT_EQ(found.items, (std::vector<int>{2, 3}));
  tree.FindWithin({-3, 0, 1}, 0.25, &found);
  EXPECT_TRUE(found.items.empty());
}

}  // namespace
}  // namespace slcmap
