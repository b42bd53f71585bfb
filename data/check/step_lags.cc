#include "data/check/step_lags.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "data/asl_files.h"
#include "data/check/gyro_integral.h"
#include "data/check/left_right.h"

namespace slcmap {
namespace {

constexpr int kMaxLag = 6;
constexpr int kLags = 2 * kMaxLag + 1;
constexpr double kStepShare = 0.05;  // of a step, by which nearer and farther places make it differ
constexpr double kMostMisfit = 9;    // squared deviations; a lost image fits nothing
constexpr double kChangePrice = 40;  // of a lag, in the same

// The median movement of corners from one image to the next, in pixels.
std::optional<Eigen::Vector2d> MedianFlow_px(const cv::Mat& before, const cv::Mat& after,
                                             const cv::Mat& mask) {
  constexpr int kCorners = 80;
  constexpr size_t kMinCorners = 12;
  std::vector<cv::Point2f> corners, found;
  cv::goodFeaturesToTrack(before, corners, kCorners, 0.02, 10, mask);
  if (corners.size() < kMinCorners) return std::nullopt;
  std::vector<uchar> is_found;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(before, after, corners, found, is_found, error, {15, 15}, 4);
  std::vector<double> x_px, y_px;
  for (size_t i = 0; i < corners.size(); ++i) {
    if (!is_found[i]) continue;
    x_px.push_back(found[i].x - corners[i].x);
    y_px.push_back(found[i].y - corners[i].y);
  }
  if (x_px.size() < kMinCorners) return std::nullopt;
  return Eigen::Vector2d(Median(x_px), Median(y_px));
}

cv::Mat Halved(const cv::Mat& image) {
  cv::Mat half;
  if (!image.empty()) cv::resize(image, half, {}, 0.5, 0.5, cv::INTER_AREA);
  return half;
}

// What it costs to take the right step for the same as the left one.
double StepMisfit(const std::optional<Eigen::Vector2d>& left,
                  const std::optional<Eigen::Vector2d>& right, double noise_rad) {
  if (!left || !right) return 0.5 * kMostMisfit;
  const double sigma_rad = noise_rad + kStepShare * std::max(left->norm(), right->norm());
  return std::min(kMostMisfit, (*left - *right).squaredNorm() / (sigma_rad * sigma_rad));
}

std::optional<Eigen::Vector2d> At(const ImageSteps& steps, std::ptrdiff_t i) {
  return i >= 0 && i < std::ssize(steps) ? steps[static_cast<size_t>(i)] : std::nullopt;
}

// The mean square by which what is left of a piece's steps, without those of the gyroscope so many
// later, changes from one to the next; what comes of moving on changes slowly.
double Unexplained(const ImageSteps& left, const ImageSteps& gyro, size_t first, size_t end,
                   int later) {
  constexpr double kLeastSteps = 5;
  std::optional<Eigen::Vector2d> before;
  double squares = 0, count = 0;
  for (size_t i = first; i < end; ++i) {
    const auto turn = At(gyro, static_cast<std::ptrdiff_t>(i) + later);
    if (!left[i] || !turn) continue;
    const Eigen::Vector2d rest = *left[i] - *turn;
    if (before) squares += (rest - *before).squaredNorm(), ++count;
    before = rest;
  }
  return count < kLeastSteps ? 1e9 : squares / count;
}

}  // namespace

ImageSteps FollowSteps(const SequenceSource& source, int camera, const Progress& progress) {
  const Rig& rig = source.info().rig;
  const size_t pairs = source.info().pair_stamps_ns.size();
  const double per_half_px = 2 / rig.cameras[camera].MiddleFocal_px();
  const cv::Mat mask = Halved(rig.masks[camera]);
  const Eigen::Quaterniond R_left_camera =
      camera == 0 ? Eigen::Quaterniond::Identity() : LeftRight(rig).rotation;
  ImageSteps steps;
  cv::Mat before;
  for (size_t i = 0; i < pairs; ++i) {
    progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(pairs));
    const cv::Mat image = Halved(source.ReadImage(i, camera).image);
    if (i > 0) {
      const auto flow_px =
          before.empty() || image.empty() ? std::nullopt : MedianFlow_px(before, image, mask);
      steps.push_back(std::nullopt);
      if (flow_px) {
        const Eigen::Vector3d step(flow_px->x(), flow_px->y(), 0);
        steps.back() = per_half_px * (R_left_camera * step).head<2>();
      }
    }
    before = image;
  }
  return steps;
}

ImageSteps StepsOfGyro(const std::vector<int64_t>& stamps_ns, const Rig& rig,
                       const std::vector<ImuSample>& imu) {
  const GyroIntegral gyro(imu);
  const int64_t offset_ns = ToNanoseconds(rig.camera_time_offset_s);
  ImageSteps steps;
  for (size_t i = 1; i < stamps_ns.size(); ++i) {
    const int64_t from_ns = stamps_ns[i - 1] + offset_ns, to_ns = stamps_ns[i] + offset_ns;
    steps.push_back(std::nullopt);
    if (imu.empty() || !gyro.Covers(from_ns, to_ns)) continue;
    const Eigen::Vector3d turn_rad =
        rig.T_imu_camera[0].rotation.conjugate() * gyro.Between(from_ns, to_ns);
    steps.back() = Eigen::Vector2d(-turn_rad.y(), turn_rad.x());
  }
  return steps;
}

std::vector<int> FindLags(const ImageSteps& left, const ImageSteps& right, double noise_rad) {
  std::vector<std::array<int, kLags>> came_from(left.size());
  std::array<double, kLags> cost{};
  for (size_t i = 0; i < left.size(); ++i) {
    const auto cheapest =
        static_cast<int>(std::min_element(cost.begin(), cost.end()) - cost.begin());
    const double changed = cost[static_cast<size_t>(cheapest)] + kChangePrice;
    for (size_t k = 0; k < kLags; ++k) {
      came_from[i][k] = cost[k] <= changed ? static_cast<int>(k) : cheapest;
      const auto later = static_cast<std::ptrdiff_t>(i + k) - kMaxLag;
      cost[k] = std::min(cost[k], changed) + StepMisfit(left[i], At(right, later), noise_rad);
    }
  }
  std::vector<int> lags(left.size());
  auto k = static_cast<int>(std::min_element(cost.begin(), cost.end()) - cost.begin());
  for (size_t i = left.size(); i-- > 0;) {
    lags[i] = k - kMaxLag;
    k = came_from[i][static_cast<size_t>(k)];
  }
  return lags;
}

int LateBy(const ImageSteps& left, const ImageSteps& gyro, size_t first, size_t end) {
  constexpr double kClearlyLess = 0.7;
  double best = kClearlyLess * Unexplained(left, gyro, first, end, 0);
  int late = 0;
  for (int later = -kMaxLag; later <= kMaxLag; ++later) {
    const double unexplained = Unexplained(left, gyro, first, end, later);
    if (unexplained >= best) continue;
    best = unexplained;
    late = later;
  }
  return late;
}

}  // namespace slcmap
