#include "data/check/row_alignment.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "data/asl_files.h"
#include "data/calibration.h"

namespace slcmap {
namespace {

constexpr double kFirstScale_px = 30, kLastScale_px = 0.25, kScaleStep = 0.5;
constexpr double kTurnPrior_rad = 0.2, kTurnPriorAboutY_rad = 5e-3;
constexpr double kHeld_rad = 1e-7;
constexpr double kBetterRows = 0.8;  // of what the rows are off without a turn about y, and
constexpr double kClearSigmas = 5, kClearAboutY_rad = 2e-3;  // for y to be believed
constexpr int kSteps = 4;                                    // at each scale
constexpr double kRowAgree_px = 2.5;
constexpr int kRowFeatures = 150;
constexpr double kRowFeatureDistance_px = 20, kRowFeatureQuality = 0.02;
const cv::Size kRowPatch_px(15, 15);
constexpr int kRowLevels = 4;
const cv::TermCriteria kRowUntil(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 30, 0.005);
constexpr double kRowBorder_px = 6, kRowUsualDepth_m = 4;
constexpr double kMaxReturn_px = 0.3;  // between a feature and what is found from its match

struct RowLinear {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
};

RowLinear Linearise(const std::vector<RayPair>& matches, const RigidTransform& T_left_right,
                    const Eigen::Quaterniond& turn, double prior_about_y_rad, double scale_rad) {
  RowLinear linear;
  const Eigen::Vector3d direction = T_left_right.translation.normalized();
  for (const RayPair& rays : matches) {
    const Epipolar e = EpipolarOf(rays, T_left_right.rotation * turn, direction);
    const double u = e.residual_rad / scale_rad, weight = 1 / ((1 + u * u) * scale_rad * scale_rad);
    linear.H += weight * e.turn_jacobian * e.turn_jacobian.transpose();
    linear.g -= weight * e.turn_jacobian * e.residual_rad;
  }
  const Eigen::Vector3d at = LogRotation(turn);
  const Eigen::Vector3d sigmas(kTurnPrior_rad, prior_about_y_rad, kTurnPrior_rad);
  const Eigen::Vector3d weights = sigmas.array().pow(-2);
  linear.H.diagonal() += weights;
  linear.g -= weights.cwiseProduct(at);
  return linear;
}

struct Turn {
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  Eigen::Vector3d sigma_rad = Eigen::Vector3d::Ones();
};

// From coarse to fine; at 0 where the matches say nothing.
Turn FindTurn(const std::vector<RayPair>& matches, const RigidTransform& T_left_right,
              double focal_px, double prior_about_y_rad) {
  Turn found;
  RowLinear linear;
  for (double scale_px = kFirstScale_px; scale_px >= kLastScale_px; scale_px *= kScaleStep) {
    for (int step = 0; step < kSteps; ++step) {
      linear = Linearise(matches, T_left_right, found.turn, prior_about_y_rad, scale_px / focal_px);
      const Eigen::Vector3d change_rad = linear.H.ldlt().solve(linear.g);
      if (!change_rad.allFinite()) return Turn();
      found.turn = (found.turn * ExpRotation(change_rad)).normalized();
    }
  }
  found.sigma_rad = linear.H.inverse().diagonal().cwiseSqrt();
  return found;
}

// Distances from the rows, in pixels.
std::vector<double> Distances_px(const std::vector<RayPair>& matches,
                                 const RigidTransform& T_left_right, const Eigen::Quaterniond& turn,
                                 double focal_px) {
  std::vector<double> distances_px;
  for (const RayPair& rays : matches) {
    const Epipolar e =
        EpipolarOf(rays, T_left_right.rotation * turn, T_left_right.translation.normalized());
    // Sampson's distance shares the error between both rays.
    distances_px.push_back(std::numbers::sqrt2 * std::abs(e.residual_rad) * focal_px);
  }
  return distances_px;
}

class Matcher {
 public:
  explicit Matcher(const Rig& rig)
      : rig_(rig), T_left_right_(rig.T_imu_camera[0].Inverse() * rig.T_imu_camera[1]) {}

  void Match(const cv::Mat& left, const cv::Mat& right, std::vector<RayPair>* matches) const {
    std::vector<cv::Point2f> corners, features, guess;
    cv::goodFeaturesToTrack(left, corners, kRowFeatures, kRowFeatureQuality,
                            kRowFeatureDistance_px);
    for (const cv::Point2f& corner : corners) {
      const auto ray = rig_.cameras[0].Unproject({corner.x, corner.y});
      if (!ray) continue;
      const auto pixel =
          rig_.cameras[1].Project(T_left_right_.Inverse() * (kRowUsualDepth_m * *ray));
      if (!pixel || !rig_.cameras[1].Contains(*pixel)) continue;
      features.push_back(corner);
      guess.emplace_back(static_cast<float>(pixel->x()), static_cast<float>(pixel->y()));
    }
    if (features.empty()) return;
    const std::vector<cv::Point2f> found = Follow(left, right, features, guess);
    const std::vector<cv::Point2f> back = Follow(right, left, found, features);
    for (size_t i = 0; i < features.size(); ++i) {
      if (cv::norm(back[i] - features[i]) > kMaxReturn_px) continue;
      if (!rig_.cameras[1].Contains({found[i].x, found[i].y}, kRowBorder_px)) continue;
      const auto a = rig_.cameras[0].Unproject({features[i].x, features[i].y});
      const auto b = rig_.cameras[1].Unproject({found[i].x, found[i].y});
      if (a && b) matches->push_back({*a, *b});
    }
  }

 private:
  // Where the features of one image are in the other; far outside where they were not found.
  static std::vector<cv::Point2f> Follow(const cv::Mat& from, const cv::Mat& to,
                                         const std::vector<cv::Point2f>& features,
                                         std::vector<cv::Point2f> guess) {
    std::vector<uchar> found;
    std::vector<float> error;
    cv::calcOpticalFlowPyrLK(from, to, features, guess, found, error, kRowPatch_px, kRowLevels,
                             kRowUntil, cv::OPTFLOW_USE_INITIAL_FLOW);
    for (size_t i = 0; i < guess.size(); ++i) {
      if (!found[i]) guess[i] = cv::Point2f(-1e4F, -1e4F);
    }
    return guess;
  }

  const Rig rig_;
  const RigidTransform T_left_right_;
};

}  // namespace

RowAlignment AlignRows(const std::vector<RayPair>& matches, const RigidTransform& T_left_right,
                       double focal_px) {
  RowAlignment alignment;
  alignment.matches = static_cast<int>(matches.size());
  if (matches.empty()) return alignment;
  const auto rows_px = [&](const Eigen::Quaterniond& turned) {
    return Median(Distances_px(matches, T_left_right, turned, focal_px));
  };
  Turn found = FindTurn(matches, T_left_right, focal_px, kTurnPriorAboutY_rad);
  const Turn held = FindTurn(matches, T_left_right, focal_px, kHeld_rad);
  const double about_y_rad = std::abs(LogRotation(found.turn).y());
  // Pairs that show nearly the same repeat their errors: sigma alone would believe them.
  if (about_y_rad < std::max(kClearAboutY_rad, kClearSigmas * found.sigma_rad.y()) ||
      rows_px(found.turn) > kBetterRows * rows_px(held.turn)) {
    found = held;
  }
  const Eigen::Quaterniond& turn = found.turn;
  alignment.turn_rad = LogRotation(turn);
  alignment.turn_sigma_rad = found.sigma_rad;
  alignment.rows_px = rows_px(Eigen::Quaterniond::Identity());
  const std::vector<double> mended_px = Distances_px(matches, T_left_right, turn, focal_px);
  alignment.mended_rows_px = Median(mended_px);
  const auto agree = std::count_if(mended_px.begin(), mended_px.end(),
                                   [](double distance_px) { return distance_px < kRowAgree_px; });
  alignment.agreeing_share = static_cast<double>(agree) / static_cast<double>(matches.size());
  return alignment;
}

std::vector<RayPair> MatchFinely(const SequenceSource& source, const Rig& rig, size_t pairs,
                                 const Progress& progress) {
  const Matcher matcher(rig);
  const size_t all = source.info().pair_stamps_ns.size();
  std::vector<RayPair> matches;
  for (size_t i = 0; i < all; i += std::max<size_t>(1, all / pairs)) {
    progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(all));
    const cv::Mat left = source.ReadImage(i, 0).image, right = source.ReadImage(i, 1).image;
    if (!left.empty() && !right.empty()) matcher.Match(left, right, &matches);
  }
  return matches;
}

}  // namespace slcmap
