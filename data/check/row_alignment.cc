#include "data/check/row_alignment.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "data/calibration/calibration.h"
#include "data/check/view_geometry.h"
#include "data/source/asl_files.h"

namespace slcmap::inline data {
namespace {

constexpr double kFirstScale_px = 30, kLastScale_px = 0.25, kScaleStep = 0.5;
constexpr double kTurnPrior_rad = 0.2, kTurnPriorAboutY_rad = 5e-3;
constexpr double kFocalPrior = 0.01;
constexpr double kHeld_rad = 1e-7, kHeldFocal = 1e-7;
constexpr double kBetterRows = 0.8;  // of what the rows are off without a number, and
constexpr double kClearSigmas = 5, kClearAboutY_rad = 2e-3, kClearFocal = 1e-3;  // to believe it
constexpr int kSteps = 4;                                                        // at each scale
constexpr int kRowFeatures = 150;
constexpr double kRowFeatureDistance_px = 20, kRowFeatureQuality = 0.02;
const cv::Size kRowPatch_px(15, 15);
constexpr int kRowLevels = 4;
const cv::TermCriteria kRowUntil(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 30, 0.005);
constexpr double kRowBorder_px = 6;
constexpr double kMaxReturn_px = 0.3;  // between a feature and what is found from its match

struct Mend {
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  double right_focal = 0;
  Eigen::Vector4d sigma = Eigen::Vector4d::Ones();  // of the turn about x, y, z, and the focal
};

class RowSolver {
 public:
  RowSolver(const std::vector<RayPair>& matches, const RigidTransform& T_left_right,
            double focal_px, const std::vector<Eigen::Vector3d>& longer)
      : matches_(matches),
        longer_(longer),
        rotation_(T_left_right.rotation),
        direction_(T_left_right.translation.normalized()),
        focal_px_(focal_px) {}

  // From coarse to fine; nothing where the matches say nothing. The standard deviations are of what
  // is given, about which the solution is found.
  Mend Solve(double about_y_sigma_rad, double focal_sigma) const {
    const Eigen::Vector4d sigmas(kTurnPrior_rad, about_y_sigma_rad, kTurnPrior_rad, focal_sigma);
    Mend mend;
    Linear linear;
    for (double scale_px = kFirstScale_px; scale_px >= kLastScale_px; scale_px *= kScaleStep) {
      for (int step = 0; step < kSteps; ++step) {
        linear = Linearise(mend, sigmas, scale_px / focal_px_);
        const Eigen::Vector4d change = linear.H.ldlt().solve(linear.g);
        if (!change.allFinite()) return {};
        mend.turn = (mend.turn * ExpRotation(change.head<3>())).normalized();
        mend.right_focal += change[3];
      }
    }
    mend.sigma = linear.H.inverse().diagonal().cwiseSqrt();
    if (focal_sigma == kHeldFocal) mend.right_focal = 0;
    return mend;
  }

  // Distances from the rows, in pixels.
  std::vector<double> Distances_px(const Mend& mend) const {
    std::vector<double> distances_px;
    for (size_t i = 0; i < matches_.size(); ++i) {
      // Sampson's distance shares the error between both rays.
      distances_px.push_back(std::numbers::sqrt2 * std::abs(At(i, mend).residual_rad) * focal_px_);
    }
    return distances_px;
  }

  double Rows_px(const Mend& mend) const { return Median(Distances_px(mend)); }

 private:
  struct Linear {
    Eigen::Matrix4d H = Eigen::Matrix4d::Zero();
    Eigen::Vector4d g = Eigen::Vector4d::Zero();
  };

  Epipolar At(size_t match, const Mend& mend) const {
    RayPair rays = matches_[match];
    if (!longer_.empty()) {
      rays.second += mend.right_focal / kLongerFocal * (longer_[match] - rays.second);
      rays.second.normalize();
    }
    return ComputeEpipolar(rays, rotation_ * mend.turn, direction_);
  }

  Linear Linearise(const Mend& mend, const Eigen::Vector4d& sigmas, double scale_rad) const {
    Linear linear;
    Mend longer = mend;
    longer.right_focal += kLongerFocal;
    for (size_t i = 0; i < matches_.size(); ++i) {
      const Epipolar e = At(i, mend);
      const double u = e.residual_rad / scale_rad;
      const double weight = 1 / ((1 + u * u) * scale_rad * scale_rad);
      Eigen::Vector4d jacobian = Eigen::Vector4d::Zero();
      jacobian.head<3>() = e.turn_jacobian;
      if (!longer_.empty()) {
        jacobian[3] = (At(i, longer).residual_rad - e.residual_rad) / kLongerFocal;
      }
      linear.H += weight * jacobian * jacobian.transpose();
      linear.g -= weight * jacobian * e.residual_rad;
    }
    Eigen::Vector4d at;
    at << LogRotation(mend.turn), mend.right_focal;
    const Eigen::Vector4d weights = sigmas.array().pow(-2);
    linear.H.diagonal() += weights;
    linear.g -= weights.cwiseProduct(at);
    return linear;
  }

  const std::vector<RayPair>& matches_;
  const std::vector<Eigen::Vector3d>& longer_;
  const Eigen::Quaterniond rotation_;
  const Eigen::Vector3d direction_;
  const double focal_px_;
};

// Pairs that show nearly the same repeat their errors: sigma alone would believe a number.
bool IsClear(double number, double sigma, double least) {
  return std::abs(number) >= std::max(least, kClearSigmas * sigma);
}

// A turn, about y only where that is clear and rows agree better: it is seen in parts of the images
// alone.
Mend FindTurn(const RowSolver& solver, double prior_right_focal) {
  const Mend held = solver.Solve(kHeld_rad, prior_right_focal);
  const Mend found = solver.Solve(kTurnPriorAboutY_rad, prior_right_focal);
  const bool is_clear = IsClear(LogRotation(found.turn).y(), found.sigma.y(), kClearAboutY_rad) &&
                        solver.Rows_px(found) <= kBetterRows * solver.Rows_px(held);
  return is_clear ? found : held;
}

// With a focal length where that is as clear.
Mend FindMend(const RowSolver& solver, const Mend& turned) {
  const Mend found = FindTurn(solver, kFocalPrior);
  const bool is_clear = IsClear(found.right_focal, found.sigma[3], kClearFocal) &&
                        solver.Rows_px(found) <= kBetterRows * solver.Rows_px(turned);
  return is_clear ? found : turned;
}

class Matcher {
 public:
  explicit Matcher(const Rig& rig)
      : rig_(rig),
        like_left_(rig),
        T_left_right_(rig.T_imu_camera[0].Inverse() * rig.T_imu_camera[1]) {}

  void Match(const cv::Mat& left_image, const cv::Mat& right_image,
             std::vector<RayPair>* matches) const {
    const cv::Mat left = like_left_.Left(left_image), right = like_left_.Right(right_image);
    std::vector<cv::Point2f> corners, features, guess;
    cv::goodFeaturesToTrack(left_image, corners, kRowFeatures, kRowFeatureQuality,
                            kRowFeatureDistance_px, rig_.masks[0]);
    for (const cv::Point2f& corner : corners) {
      const auto ray = rig_.cameras[0].Unproject({corner.x, corner.y});
      if (!ray) continue;
      const auto pixel = rig_.cameras[1].Project(T_left_right_.Inverse() * (kUsualDepth_m * *ray));
      if (!pixel || !rig_.cameras[1].Contains(*pixel)) continue;
      features.push_back(corner);
      guess.push_back(
          like_left_.FromRight({static_cast<float>(pixel->x()), static_cast<float>(pixel->y())}));
    }
    if (features.empty()) return;
    const std::vector<cv::Point2f> found = Follow(left, right, features, guess);
    const std::vector<cv::Point2f> back = Follow(right, left, found, features);
    for (size_t i = 0; i < features.size(); ++i) {
      if (cv::norm(back[i] - features[i]) > kMaxReturn_px) continue;
      const cv::Point2f right_px = like_left_.ToRight(found[i]);
      if (!rig_.cameras[1].Contains({right_px.x, right_px.y}, kRowBorder_px)) continue;
      const auto a = rig_.cameras[0].Unproject({features[i].x, features[i].y});
      const auto b = rig_.cameras[1].Unproject({right_px.x, right_px.y});
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
  const LikeLeft like_left_;
  const RigidTransform T_left_right_;
};

// With a baseline along x.
RowAlignment AlignLevelRows(const std::vector<RayPair>& matches, const RigidTransform& T_left_right,
                            double focal_px, const std::vector<Eigen::Vector3d>& longer) {
  RowAlignment alignment;
  alignment.matches = static_cast<int>(matches.size());
  if (matches.empty()) return alignment;
  const RowSolver solver(matches, T_left_right, focal_px, longer);
  const Mend turned = FindTurn(solver, kHeldFocal);
  const Mend found = longer.empty() ? turned : FindMend(solver, turned);
  alignment.turn_rad = LogRotation(found.turn);
  alignment.turn_sigma_rad = found.sigma.head<3>();
  alignment.right_focal = found.right_focal;
  alignment.right_focal_sigma = found.sigma[3];
  alignment.rows_px = solver.Rows_px({});
  alignment.turned_rows_px = solver.Rows_px(turned);
  const std::vector<double> mended_px = solver.Distances_px(found);
  alignment.mended_rows_px = Median(mended_px);
  const auto agree = std::count_if(mended_px.begin(), mended_px.end(),
                                   [](double distance_px) { return distance_px < kAgree_px; });
  alignment.agreeing_share = static_cast<double>(agree) / static_cast<double>(matches.size());
  return alignment;
}

}  // namespace

std::vector<Eigen::Vector3d> LongerRays(const std::vector<RayPair>& matches, const Camera& right) {
  Camera longer = right;
  longer.fx_px *= 1 + kLongerFocal;
  longer.fy_px *= 1 + kLongerFocal;
  std::vector<Eigen::Vector3d> rays;
  for (const RayPair& match : matches) {
    const auto px = right.Project(match.second);
    const auto ray = px ? longer.Unproject(*px) : std::nullopt;
    rays.push_back(ray ? ray->normalized() : match.second);
  }
  return rays;
}

// Which turn the rows do not show hangs on where the baseline points: where the second camera is
// not on the right of the first, both are looked at turned about their axes.
RowAlignment AlignRows(const std::vector<RayPair>& matches, const RigidTransform& T_left_right,
                       double focal_px, const std::vector<Eigen::Vector3d>& longer) {
  constexpr double kLevel_rad = 0.5;
  const Eigen::Vector3d& t = T_left_right.translation;
  const double angle_rad = std::atan2(t.y(), t.x());
  if (std::abs(angle_rad) < kLevel_rad) {
    return AlignLevelRows(matches, T_left_right, focal_px, longer);
  }
  const Eigen::Quaterniond R_camera_level = ExpRotation({0, 0, angle_rad});
  const Eigen::Quaterniond R_level_camera = R_camera_level.conjugate();
  std::vector<RayPair> level;
  for (const RayPair& rays : matches) {
    level.push_back({R_level_camera * rays.first, R_level_camera * rays.second});
  }
  std::vector<Eigen::Vector3d> level_longer;
  for (const Eigen::Vector3d& ray : longer) level_longer.push_back(R_level_camera * ray);
  RowAlignment alignment = AlignLevelRows(
      level, {R_level_camera * T_left_right.rotation * R_camera_level, R_level_camera * t},
      focal_px, level_longer);
  alignment.turn_rad = R_camera_level * alignment.turn_rad;
  const Eigen::Matrix3d squares = R_camera_level.toRotationMatrix().cwiseAbs2();
  alignment.turn_sigma_rad = (squares * alignment.turn_sigma_rad.cwiseAbs2()).cwiseSqrt();
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

std::vector<RayPair> MatchPair(const SequenceSource& source, const Rig& rig, size_t pair,
                               int later) {
  const auto right_pair = static_cast<std::ptrdiff_t>(pair) + later;
  std::vector<RayPair> matches;
  if (right_pair < 0 || right_pair >= std::ssize(source.info().pair_stamps_ns)) return matches;
  const cv::Mat left = source.ReadImage(pair, 0).image;
  const cv::Mat right = source.ReadImage(static_cast<size_t>(right_pair), 1).image;
  if (!left.empty() && !right.empty()) Matcher(rig).Match(left, right, &matches);
  return matches;
}

}  // namespace slcmap::data
