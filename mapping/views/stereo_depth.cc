#include "mapping/views/stereo_depth.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "data/io/yaml.h"
#include "mapping/map/occupancy_map.h"

namespace slcmap::inline mapping {
namespace {

constexpr int kUniquenessPercent = 5;  // by which the best disparity beats all others

constexpr OptionTable kDenseTable{Option{"min_travel_m", &DenseOptions::min_travel_m, 0.0, 10.0},
                                  Option{"min_turn_rad", &DenseOptions::min_turn_rad, 0.0, 3.0},
                                  Option{"min_depth_m", &DenseOptions::min_depth_m, 0.05, 100.0},
                                  Option{"max_depth_m", &DenseOptions::max_depth_m, 0.1, 1000.0},
                                  Option{"grid_px", &DenseOptions::grid_px, 1, 64},
                                  Option{"pair_sigma_px", &DenseOptions::pair_sigma_px, 0.0, 10.0},
                                  Option{"voxel_m", &DenseOptions::voxel_m, kMinVoxel_m, 1.0},
                                  Option{"max_sigma_m", &DenseOptions::max_sigma_m, 1e-3, 10.0}};

}  // namespace

void DenseOptions::Check() const {
  kDenseTable.Check("mapping.dense", *this);
  CheckOrder("mapping.dense", "min_depth_m", min_depth_m, "max_depth_m", max_depth_m);
}
void DenseOptions::Read(YamlSection section) {
  section.Skip("threads");  // as options.yaml of earlier maps has it
  kDenseTable.Read(section, this,
                   {"uniqueness_percent", "max_grazing_deg", "pose_sigma_px", "neighbours",
                    "window_views", "min_views", "min_baseline_m", "agree_sigmas"});
}

namespace {

constexpr int kBlock_px = 5;  // of matching, at half size
constexpr int kFit_px = 3;    // half width of the window that a plane is fitted in
// Of disparities within it, at half size: matches of faint texture go in steps of a pixel.
constexpr double kMaxStep_px = 1.6;
constexpr double kMinFitShare = 0.6;     // of the window: at a depth edge there are fewer
constexpr double kMatchSigma_px = 0.35;  // of disparities, at full size
constexpr int kMaxLeftRight_px = 2;      // between a match and the one back, at half size
constexpr int kSpeckle_px = 60;          // smaller patches of equal disparity are noise

int DisparitiesAtHalfSize(const Camera& camera, double baseline_m, const DenseOptions& options) {
  const double most_px = camera.fx_px * baseline_m / options.min_depth_m / 2;
  const int rounded = static_cast<int>(std::ceil(most_px / 16)) * 16;
  return std::clamp(rounded, 16, camera.width_px / 32 * 16);
}

// Disparities of the left image at half size, in pixels of that size; not positive where unknown.
cv::Mat MatchAtHalfSize(const StereoImage& pair, int disparities) {
  cv::Mat left, right, matched;
  cv::resize(pair.left, left, {}, 0.5, 0.5, cv::INTER_AREA);
  cv::resize(pair.right, right, {}, 0.5, 0.5, cv::INTER_AREA);
  // Pixels nearer to the left border than the largest disparity are matched too.
  for (cv::Mat* image : {&left, &right}) {
    cv::copyMakeBorder(*image, *image, 0, 0, disparities, 0, cv::BORDER_REPLICATE);
  }
  constexpr int kArea = kBlock_px * kBlock_px;
  const auto matcher =
      cv::StereoSGBM::create(0, disparities, kBlock_px, 8 * kArea, 32 * kArea, kMaxLeftRight_px, 31,
                             kUniquenessPercent, kSpeckle_px, 1, cv::StereoSGBM::MODE_SGBM_3WAY);
  matcher->compute(left, right, matched);
  matched = matched.colRange(disparities, matched.cols);
  cv::Mat disparity;
  matched.convertTo(disparity, CV_32F, 1.0 / 16);
  return disparity;
}

float MedianAround(const cv::Mat& disparity, int u, int v) {
  std::array<float, 9> values;
  int count = 0;
  for (int y = v - 1; y <= v + 1; ++y) {
    for (int x = u - 1; x <= u + 1; ++x) {
      const float value = disparity.at<float>(y, x);
      if (value > 0) values[count++] = value;
    }
  }
  if (count < 5) return 0;
  std::nth_element(values.begin(), values.begin() + count / 2, values.begin() + count);
  return values[count / 2];
}

// The disparities around a pixel of the half size as a plane: value and slopes.
std::optional<Eigen::Vector3d> PlaneAround(const cv::Mat& disparity, int u, int v) {
  if (u < kFit_px || v < kFit_px || u >= disparity.cols - kFit_px ||
      v >= disparity.rows - kFit_px) {
    return std::nullopt;
  }
  const float centre = MedianAround(disparity, u, v);
  if (centre <= 0) return std::nullopt;
  SlopeFit fit;
  for (int y = -kFit_px; y <= kFit_px; ++y) {
    const float* row = disparity.ptr<float>(v + y) + u;
    for (int x = -kFit_px; x <= kFit_px; ++x) {
      if (std::abs(row[x] - centre) < kMaxStep_px) fit.Add(x, y, row[x]);
    }
  }
  constexpr double kWindow = (2 * kFit_px + 1) * (2 * kFit_px + 1);
  if (fit.count() < kMinFitShare * kWindow) return std::nullopt;
  return fit.Solve();
}

}  // namespace

double Baseline_m(const Rig& rig, int left_camera) {
  return (rig.T_imu_camera[left_camera + 1].translation - rig.T_imu_camera[left_camera].translation)
      .norm();
}

DepthGrid StereoDepth(const StereoImage& pair, const cv::Mat& mask, const Rig& rig,
                      const DenseOptions& options, int left_camera) {
  const Camera& camera = rig.cameras[left_camera];
  const double baseline_m = Baseline_m(rig, left_camera);
  DepthGrid grid(camera, options.grid_px);
  if (pair.left.empty() || pair.right.empty()) return grid;
  const cv::Mat disparity =
      MatchAtHalfSize(pair, DisparitiesAtHalfSize(camera, baseline_m, options));
  const double per_px = 1 / (camera.fx_px * baseline_m);  // inverse depth of a disparity
  const double min_cosine = std::cos(kDepthMaxGrazing_deg * M_PI / 180);
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const int u = grid.ColumnPixel(column), v = grid.RowPixel(row);
      if (mask.at<uint8_t>(v, u) == 0) continue;
      const auto plane = PlaneAround(disparity, u / 2, v / 2);
      if (!plane) continue;
      // A pixel of the half size is two wide, and its middle is between the two.
      const double u_off = 0.5 * (u % 2) - 0.25, v_off = 0.5 * (v % 2) - 0.25;
      const double disparity_px = 2 * ((*plane)[0] + (*plane)[1] * u_off + (*plane)[2] * v_off);
      DepthNode node;
      node.inverse_depth = static_cast<float>(disparity_px * per_px);
      node.slope_x = static_cast<float>((*plane)[1] * per_px);
      node.slope_y = static_cast<float>((*plane)[2] * per_px);
      node.sigma = static_cast<float>(kMatchSigma_px * per_px);
      node.grey = pair.left.at<uint8_t>(v, u);
      if (node.inverse_depth * options.max_depth_m < 1 ||
          node.inverse_depth * options.min_depth_m > 1 ||
          CosineOfView(node, camera, PinholeRay(camera, u, v)) < min_cosine) {
        continue;
      }
      grid.At(column, row) = node;
    }
  }
  return grid;
}

}  // namespace slcmap::mapping
