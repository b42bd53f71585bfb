#include "mapping/dense/depth_fusion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "mapping/dense/depth_refinement.h"
#include "mapping/views/stereo_depth.h"
#include "tests/mapping/dense/wall_depth.h"
#include "tests/testing/pinhole_camera.h"
#include "tests/testing/room_views.h"

namespace slcmap {
namespace {

const Camera kFusionCamera = testing::PinholeCamera(400, 300, 250, 199.5, 149.5);

// A wall across the optical axis, seen with noise.
DepthGrid NoisyWallAt(double depth_m, double sigma_m, int seed) {
  DepthGrid grid(kFusionCamera, 5);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  for (DepthNode& node : grid.nodes) {
    node.inverse_depth = static_cast<float>(1 / (depth_m + sigma_m * noise(random)));
    node.sigma = static_cast<float>(sigma_m / (depth_m * depth_m));
    node.grey = 90;
  }
  return grid;
}

// From a place on the x axis, along it or back.
RigidTransform Looking(double x_m, double sense = 1) {
  const Eigen::Matrix3d R = (Eigen::Matrix3d() << 0, 0, sense, -sense, 0, 0, 0, -1, 0).finished();
  return {Eigen::Quaterniond(R), {x_m, 0, 0}};
}

// At x = 2 m.
std::vector<DensePoint> WallOfTwelveNoisyViews() {
  DepthFusion fusion((DenseOptions()));
  for (int i = 0; i < 12; ++i) {
    fusion.Add(Looking(0.02 * i), kFusionCamera, NoisyWallAt(2.0 - 0.02 * i, 0.03, i));
  }
  return fusion.Points();
}

TEST(DepthFusion, MakesOneFlatWallOfManyNoisyViews) {
  const DenseOptions options;
  const std::vector<DensePoint> points = WallOfTwelveNoisyViews();
  // The views see some 3.2 x 2.4 m of it.
  const double voxels = 3.2 * 2.4 / (options.voxel_m * options.voxel_m);
  EXPECT_GT(points.size(), 0.7 * voxels);
  EXPECT_LT(points.size(), 1.3 * voxels);
  double squared = 0;
  for (const DensePoint& point : points) {
    squared += std::pow(point.p_world.x() - 2, 2);
    EXPECT_LT(point.normal_world.x(), -0.8);
    EXPECT_EQ(point.grey, 90);
  }
  EXPECT_LT(std::sqrt(squared / static_cast<double>(points.size())), 0.01);
}

TEST(DepthFusion, KeepsTheSidesOfAThinWallApart) {
  DepthFusion fusion((DenseOptions()));
  for (int i = 0; i < 8; ++i) {
    fusion.Add(Looking(0), kFusionCamera, NoisyWallAt(2.0, 0.01, i));
    fusion.Add(Looking(4.03, -1), kFusionCamera, NoisyWallAt(2.0, 0.01, 100 + i));
  }
  int64_t near = 0, far = 0;
  for (const DensePoint& point : fusion.Points()) {
    const bool is_near = point.normal_world.x() < 0;
    ++(is_near ? near : far);
    EXPECT_NEAR(point.p_world.x(), is_near ? 2.0 : 2.03, 0.015);
  }
  EXPECT_GT(near, 1000);
  EXPECT_GT(far, 1000);
}

TEST(DepthFusion, ThinsOutWhereCoordinatesChangeTheirSignAsElsewhere) {
  const std::vector<DensePoint> points = WallOfTwelveNoisyViews();
  const auto count_at = [&](double z_m) {
    return static_cast<double>(std::count_if(
        points.begin(), points.end(),
        [&](const DensePoint& point) { return std::abs(point.p_world.z() - z_m) < 0.05; }));
  };
  const double elsewhere = 0.5 * (count_at(-0.4) + count_at(0.4));
  EXPECT_GT(elsewhere, 100);
  EXPECT_NEAR(count_at(0), elsewhere, 0.1 * elsewhere);
}

// Points of a wall that some views from one place have, each with a sigma.
std::size_t PointsOf(int views, double sigma_m, const DenseOptions& options) {
  DepthGrid wall = NoisyWallAt(2, 0.0001, 1);
  for (DepthNode& node : wall.nodes) node.sigma = static_cast<float>(sigma_m / (2 * 2));
  DepthFusion fusion(options);
  for (int i = 0; i < views; ++i) fusion.Add(Looking(0), kFusionCamera, wall);
  return fusion.Points().size();
}

TEST(DepthFusion, TakesAPlaceOnceItIsKnownToTheVoxelsSize) {
  DenseOptions options;
  EXPECT_EQ(PointsOf(20, 1.1 * options.max_sigma_m, options), 0u) << "uncertain";
  options.max_sigma_m = 0.2;
  const double sigma_m = 2.4 * options.voxel_m;
  EXPECT_GT(PointsOf(5, sigma_m, options), 2 * PointsOf(1, sigma_m, options));
}

constexpr double kDepth_m = 2, kSigma_m = 0.01;
constexpr int kStep_px = 5;

RigidTransform Beside(double x_m) { return {Eigen::Quaterniond::Identity(), {x_m, 0, 0}}; }

int64_t Known(const DepthGrid& grid) {
  return std::count_if(grid.nodes.begin(), grid.nodes.end(),
                       [](const DepthNode& node) { return node.is_known(); });
}

// How much of a wall is confirmed when other views stand at places and see it at depths.
double ConfirmedShare(const std::vector<std::pair<double, double>>& places_and_depths_m) {
  const DepthGrid wall = testing::WallAt(kDepth_m, kSigma_m, kStep_px);
  std::vector<DepthGrid> grids;
  for (const auto& [place_m, depth_m] : places_and_depths_m) {
    grids.push_back(testing::WallAt(depth_m, kSigma_m, kStep_px));
  }
  std::vector<PlacedGrid> others;
  for (std::size_t i = 0; i < grids.size(); ++i) {
    others.push_back({Beside(places_and_depths_m[i].first), &grids[i]});
  }
  const DepthGrid confirmed =
      ConfirmedDepth({Beside(0), &wall}, others, testing::SmallCamera(), DenseOptions());
  return static_cast<double>(Known(confirmed)) / static_cast<double>(wall.nodes.size());
}

TEST(DepthConfirmation, TakesThreeViewsThatAgree) {
  EXPECT_GT(ConfirmedShare({{0.2, kDepth_m}, {-0.2, kDepth_m}}), 0.6);
  EXPECT_EQ(ConfirmedShare({{0.2, kDepth_m}}), 0);
  EXPECT_EQ(ConfirmedShare({{0.2, kDepth_m}, {-0.2, kDepth_m + 0.1}}), 0);
  // Views from one place are one.
  EXPECT_EQ(ConfirmedShare({{0.2, kDepth_m}, {0.22, kDepth_m}, {0.25, kDepth_m}}), 0);
  EXPECT_EQ(ConfirmedShare({{0.02, kDepth_m}, {0.05, kDepth_m}, {-0.05, kDepth_m}}), 0);
}

TEST(DepthConfirmation, RefusesWhatMoreViewsSeeThroughThanAgreeWith) {
  const std::vector<std::pair<double, double>> agreeing = {{0.2, kDepth_m}, {-0.2, kDepth_m}};
  std::vector<std::pair<double, double>> opinions = agreeing;
  for (int i = 0; i < 4; ++i) opinions.emplace_back(0.05 * i, 3 * kDepth_m);
  EXPECT_EQ(ConfirmedShare(opinions), 0);
  opinions = agreeing;
  opinions.emplace_back(0.1, 3 * kDepth_m);  // one alone does not outvote them
  EXPECT_GT(ConfirmedShare(opinions), 0.6);
  opinions = agreeing;
  for (int i = 0; i < 4; ++i) opinions.emplace_back(0.05 * i, kDepth_m / 3);  // hidden from these
  EXPECT_GT(ConfirmedShare(opinions), 0.6);
}

// The depth of one pair of a room whose depth is known: by matching, and refined below the pixel.

constexpr std::size_t kView = 10;
constexpr double kBaseline_m = 0.11;

DenseOptions Options() {
  DenseOptions options;
  options.grid_px = 4;
  return options;
}

int CountKnown(const DepthGrid& grid) {
  return static_cast<int>(std::ranges::count_if(grid.nodes, &DepthNode::is_known));
}

// Views of a textured room, and the depth of one.
class RoomDepth : public ::testing::Test {
 protected:
  // Of disparities, absolute.
  std::vector<double> Errors_px(const DepthGrid& grid) const {
    const cv::Mat depth_m = room_.TrueDepth_m(kView);
    std::vector<double> errors_px;
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column) {
        const DepthNode& node = grid.At(column, row);
        if (!node.is_known()) continue;
        const double truth = 1 / depth_m.at<float>(grid.RowPixel(row), grid.ColumnPixel(column));
        errors_px.push_back(std::abs(node.inverse_depth - truth) * kBaseline_m *
                            room_.rig().cameras[0].fx_px);
      }
    }
    return errors_px;
  }

  static double Share(const std::vector<double>& errors_px, double limit_px) {
    const auto right =
        std::ranges::count_if(errors_px, [&](double error_px) { return error_px < limit_px; });
    return static_cast<double>(right) / static_cast<double>(errors_px.size());
  }

  // Refined by the other image.
  DepthGrid Refine(const DepthGrid& grid, const cv::Mat& left, const cv::Mat& right) const {
    DepthGrid refined = grid;
    const DepthPyramid one(left), other(right);
    const RigidTransform T_right_left(Eigen::Quaterniond::Identity(), {-kBaseline_m, 0, 0});
    RefineDepth(one, {{&other, T_right_left, 0.02}}, room_.rig().cameras[0], &refined);
    return refined;
  }

  static const RoomViews& Room() {
    static const RoomViews room(3, 0.2, 1.5);
    return room;
  }
  const RoomViews& room_ = Room();
  const StereoImage pair_ = room_.Read(kView);
  const DepthGrid grid_ = StereoDepth(pair_, room_.mask(0), room_.rig(), Options());
};

TEST_F(RoomDepth, IsFoundForMostOfIt) {
  const std::vector<double> errors_px = Errors_px(grid_);
  EXPECT_GT(errors_px.size(), grid_.nodes.size() * 6 / 10);
  EXPECT_GT(Share(errors_px, 1), 0.95);
}

TEST_F(RoomDepth, OfMaskedPixelsAndMissingImagesIsUnknown) {
  cv::Mat mask = room_.mask(0).clone();
  mask.colRange(0, 150) = cv::Scalar(0);
  const DepthGrid grid = StereoDepth(pair_, mask, room_.rig(), Options());
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; grid.ColumnPixel(column) < 150; ++column) {
      EXPECT_FALSE(grid.At(column, row).is_known());
    }
  }
  EXPECT_EQ(CountKnown(StereoDepth({}, mask, room_.rig(), Options())), 0);
}

TEST_F(RoomDepth, IsRefinedBelowThePixelWhereThereIsTexture) {
  const std::vector<double> before_px = Errors_px(grid_),
                            after_px = Errors_px(Refine(grid_, pair_.left, pair_.right));
  EXPECT_GT(after_px.size(), before_px.size() * 6 / 10);
  EXPECT_GT(Share(after_px, 0.25), 0.9);
  EXPECT_GT(Share(after_px, 0.1), Share(before_px, 0.1));
  const cv::Mat blank(room_.mask(0).size(), CV_8UC1, cv::Scalar(120));
  EXPECT_EQ(CountKnown(Refine(grid_, blank, blank)), 0);
}

}  // namespace
}  // namespace slcmap
