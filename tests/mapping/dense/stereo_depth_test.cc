// The depth of one pair of a room whose depth is known: by matching, and refined below the pixel.
#include "mapping/views/stereo_depth.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "mapping/dense/depth_refinement.h"
#include "tests/testing/room_views.h"

namespace slcmap {
namespace {

constexpr std::size_t kView = 10;
constexpr double kBaseline_m = 0.11;

DenseOptions Options() {
  DenseOptions options;
  options.grid_px = 4;
  return options;
}

struct Errors {
  std::vector<double> error_px;  // of disparities, absolute
  double Share(double limit_px) const {
    const auto right = std::count_if(error_px.begin(), error_px.end(),
                                     [&](double error) { return error < limit_px; });
    return static_cast<double>(right) / static_cast<double>(error_px.size());
  }
};

Errors GetErrors(const DepthGrid& grid, const RoomViews& room) {
  const cv::Mat depth_m = room.TrueDepth_m(kView);
  Errors errors;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const DepthNode& node = grid.At(column, row);
      if (!node.is_known()) continue;
      const double truth = 1 / depth_m.at<float>(grid.RowPixel(row), grid.ColumnPixel(column));
      errors.error_px.push_back(std::abs(node.inverse_depth - truth) * kBaseline_m *
                                room.rig().cameras[0].fx_px);
    }
  }
  return errors;
}

TEST(StereoDepth, FindsMostOfATexturedRoom) {
  const RoomViews room(3, 0.2, 1.5);
  const DepthGrid grid = StereoDepth(room.Read(kView), room.mask(0), room.rig(), Options());
  const Errors errors = GetErrors(grid, room);
  EXPECT_GT(errors.error_px.size(), grid.nodes.size() * 6 / 10);
  EXPECT_GT(errors.Share(1), 0.95);
}

TEST(StereoDepth, LeavesMaskedPixelsAndMissingImagesUnknown) {
  const RoomViews room(3, 0.2, 1.5);
  cv::Mat mask = room.mask(0).clone();
  mask.colRange(0, 150) = cv::Scalar(0);
  const DepthGrid grid = StereoDepth(room.Read(kView), mask, room.rig(), Options());
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; grid.ColumnPixel(column) < 150; ++column) {
      EXPECT_FALSE(grid.At(column, row).is_known());
    }
  }
  const DepthGrid empty = StereoDepth({}, mask, room.rig(), Options());
  EXPECT_TRUE(std::none_of(empty.nodes.begin(), empty.nodes.end(),
                           [](const DepthNode& node) { return node.is_known(); }));
}

TEST(DepthRefinement, MakesMatchesRightBelowThePixelAndKnowsHowWell) {
  const RoomViews room(3, 0.2, 1.5);
  const StereoImage pair = room.Read(kView);
  DepthGrid grid = StereoDepth(pair, room.mask(0), room.rig(), Options());
  const Errors before = GetErrors(grid, room);
  const DepthPyramid left(pair.left), right(pair.right);
  const RigidTransform T_right_left(Eigen::Quaterniond::Identity(), {-kBaseline_m, 0, 0});
  RefineDepth(left, {{&right, T_right_left, 0.02}}, room.rig().cameras[0], &grid);
  const Errors after = GetErrors(grid, room);
  EXPECT_GT(after.error_px.size(), before.error_px.size() * 6 / 10);
  EXPECT_GT(after.Share(0.25), 0.9);
  EXPECT_GT(after.Share(0.1), before.Share(0.1));
}

TEST(DepthRefinement, GivesUpPatchesWithoutTexture) {
  const RoomViews room(3, 0.2, 1.5);
  DepthGrid grid = StereoDepth(room.Read(kView), room.mask(0), room.rig(), Options());
  const DepthPyramid blank(cv::Mat(room.mask(0).size(), CV_8UC1, cv::Scalar(120)));
  const RigidTransform T_right_left(Eigen::Quaterniond::Identity(), {-kBaseline_m, 0, 0});
  RefineDepth(blank, {{&blank, T_right_left, 0.02}}, room.rig().cameras[0], &grid);
  EXPECT_TRUE(std::none_of(grid.nodes.begin(), grid.nodes.end(),
                           [](const DepthNode& node) { return node.is_known(); }));
}

}  // namespace
}  // namespace slcmap
