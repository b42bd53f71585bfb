#include "odometry/factors/calibration_estimate.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

namespace slcmap::inline odometry {
namespace {

// Odds for and against a number's being as given at which it is tied, and the tie taken off.
constexpr double kTieOdds = 4, kReleaseOdds = 1.0 / 4;
// Of a number's standard deviation to that of its tie: what is left of the scatter is a sixtieth,
// and what is known without the tie can still be told from what is known with it.
constexpr double kTightness = 8;
// Of the right principal point, which few rigs need: a tenth of a pixel of disparity would be two
// hundredths of the scale through fisheye lenses.
constexpr double kCentreTightness = 64;

bool IsRightRotation(int row) {
  const int first = kCameras + kRowRightRotation;
  return row >= first && row < first + 3;
}

bool IsRightCentre(int row) {
  const int first = kCameras + kRowRightCentre;
  return row >= first && row < first + 2;
}

constexpr double kLeastSigma = 1e-4;  // of a number, as a share of that of what was given

double GetTightness(int row) { return IsRightCentre(row) ? kCentreTightness : kTightness; }

}  // namespace

NominalPrior::NominalPrior(const CalibrationOptions& options, const CalibrationBelief& known)
    : confirm_(options.confirm),
      rows_fit_(options.rows_fit),
      sigma_scale_(options.sigma_scale),
      given_sigma_(
          IsHeld(known.covariance.diagonal().cwiseSqrt()).select(0, EstimatedSigma(options))) {
  if (!confirm_) return;
  const auto tie = [&](int row) {
    if (given_sigma_[row] == 0 || OddsOfGiven(known, row) <= kReleaseOdds) return;
    weights_[row] = GetTightness(row) / given_sigma_[row];
  };
  // Nothing tells a focal length before the rig has turned by a lot, nor turns of the right camera
  // about its y and its principal point, which trade with depth, before it has moved by a lot.
  tie(kCameras + kRowFocalLength);
  for (const int axis : {0, 1}) tie(kCameras + kRowRightCentre + axis);
  if (!options.rows_fit) return;
  for (const int axis : {1, 2}) tie(kCameras + kRowRightRotation + axis);
}

// For its being as it was given.
double NominalPrior::OddsOfGiven(const CalibrationBelief& belief, int row) const {
  const double sigma = sigma_scale_ * std::sqrt(belief.covariance(row, row));
  const double off = belief.mean[row] / sigma;
  return given_sigma_[row] / sigma * std::exp(-0.5 * off * off);
}

CalibrationBelief NominalPrior::Without(const CalibrationBelief& with) const {
  return Without(weights_, with);
}

CalibrationBelief NominalPrior::Without(const CalibrationVector& weights,
                                        const CalibrationBelief& with) const {
  if (weights.isZero(0)) return with;
  // In units of what is known, so that all numbers are alike.
  const CalibrationVector scale = with.covariance.diagonal().cwiseSqrt();
  const CalibrationMatrix scaled =
      scale.cwiseInverse().asDiagonal() * with.covariance * scale.cwiseInverse().asDiagonal();
  const CalibrationMatrix information = scaled.llt().solve(CalibrationMatrix::Identity());
  CalibrationMatrix untied = information;
  untied.diagonal() -= weights.cwiseProduct(scale).cwiseAbs2();
  const Eigen::LLT<CalibrationMatrix> cholesky(untied);
  if (cholesky.info() != Eigen::Success) return with;
  CalibrationBelief without;
  without.mean = scale.asDiagonal() * cholesky.solve(information * with.mean.cwiseQuotient(scale));
  without.covariance =
      scale.asDiagonal() * cholesky.solve(CalibrationMatrix::Identity()) * scale.asDiagonal();
  return without;
}

void NominalPrior::Update(const CalibrationBelief& with) {
  if (!confirm_) return;
  CalibrationVector but_centre = weights_;
  but_centre.segment<2>(kCameras + kRowRightCentre).setZero();
  const CalibrationBelief untied = Without(with), centred = Without(but_centre, with);
  for (int row = 0; row < kCalibrationSize; ++row) {
    if (given_sigma_[row] == 0 || (!rows_fit_ && IsRightRotation(row))) continue;
    const CalibrationBelief& belief = IsRightCentre(row) ? untied : centred;
    const double odds = OddsOfGiven(belief, row);
    const bool tied = odds > (weights_[row] > 0 ? kReleaseOdds : kTieOdds);
    const double weight = GetTightness(row) / std::sqrt(belief.covariance(row, row));
    // So that it can be taken off again, whatever the belief was.
    const double most = GetTightness(row) / (kLeastSigma * given_sigma_[row]);
    weights_[row] = tied ? std::min(std::max(weights_[row], weight), most) : 0;
  }
}

namespace {

using Eigen::Map;
using Eigen::Vector3d;

// Of what is not estimated: small beside what matters, and no trouble to the solver.
constexpr double kHeldSigma = 1e-7;
constexpr double kRelearned = 2;  // of a variance that another segment takes over

// Rows of the vector that are one item.
struct Item {
  const char* name;
  int row, count;
  bool CalibrationOptions::*estimated;
  double CalibrationOptions::*sigma;
  double CalibrationOptions::*limit;
};
constexpr std::array<Item, 10> kItems{
    {{"rotation of the IMU", kRowImuRotation, 3, &CalibrationOptions::imu_rotation,
      &CalibrationOptions::imu_rotation_sigma_rad, &CalibrationOptions::max_imu_rotation_rad},
     {"lever of the IMU", kRowLever, 3, &CalibrationOptions::lever,
      &CalibrationOptions::lever_sigma_m, &CalibrationOptions::max_lever_m},
     {"time offset", kRowTimeOffset, 1, &CalibrationOptions::time_offset,
      &CalibrationOptions::time_offset_sigma_s, &CalibrationOptions::max_time_offset_s},
     {"scale of the accelerometer", int{kRowErrors} + kErrorAccelScale, 3,
      &CalibrationOptions::imu_scale, &CalibrationOptions::imu_scale_sigma,
      &CalibrationOptions::max_imu_scale},
     {"axes of the accelerometer", int{kRowErrors} + kErrorAccelAxes, 3,
      &CalibrationOptions::imu_axes, &CalibrationOptions::imu_axes_sigma_rad,
      &CalibrationOptions::max_imu_axes_rad},
     {"scale of the gyroscope", int{kRowErrors} + kErrorGyroScale, 3,
      &CalibrationOptions::imu_scale, &CalibrationOptions::imu_scale_sigma,
      &CalibrationOptions::max_imu_scale},
     {"axes of the gyroscope", int{kRowErrors} + kErrorGyroAxes, 6, &CalibrationOptions::imu_axes,
      &CalibrationOptions::imu_axes_sigma_rad, &CalibrationOptions::max_imu_axes_rad},
     {"rotation of the right camera", kCameras + kRowRightRotation, 3,
      &CalibrationOptions::right_rotation, &CalibrationOptions::right_rotation_sigma_rad,
      &CalibrationOptions::max_right_rotation_rad},
     {"focal length", kCameras + kRowFocalLength, 1, &CalibrationOptions::focal_length,
      &CalibrationOptions::focal_length_sigma, &CalibrationOptions::max_focal_length},
     {"principal point of the right camera", kCameras + kRowRightCentre, 2,
      &CalibrationOptions::right_centre, &CalibrationOptions::right_centre_sigma_px,
      &CalibrationOptions::max_right_centre_px}}};

CalibrationVector FirstSigma(const CalibrationOptions& options) {
  return EstimatedSigma(options).cwiseMax(kHeldSigma);
}

bool IsBeyond(const Item& item, const CalibrationOptions& options, const CalibrationVector& x) {
  return !(x.segment(item.row, item.count).norm() <= options.*item.limit);
}

}  // namespace

CalibrationVector AsVector(const CalibrationState& state) {
  CalibrationVector x;
  x << Map<const Eigen::Matrix<double, kImuCalibrationSize, 1>>(state.imu.data()),
      Map<const Eigen::Matrix<double, kCameraCalibrationSize, 1>>(state.cameras.data());
  return x;
}

CalibrationVector EstimatedSigma(const CalibrationOptions& options) {
  CalibrationVector sigma;
  for (const Item& item : kItems) {
    sigma.segment(item.row, item.count)
        .setConstant(options.*item.estimated ? options.*item.sigma : 0.0);
  }
  return sigma;
}

// Options ask for more than what is held has.
CalibrationFlags IsHeld(const CalibrationVector& sigma) { return sigma.array() <= 2 * kHeldSigma; }

CalibrationPrior::CalibrationPrior(const CalibrationOptions& options) : options_(options) {
  SetFirstSigma();
}

void CalibrationPrior::SetFirstSigma() {
  first_sigma_ = FirstSigma(options_);
  covariance_ = first_sigma_.array().square().matrix().asDiagonal();
}

bool CalibrationPrior::RejectRows(const CalibrationState& state) {
  constexpr double kRowsFit_rad = 4e-4;  // some 0.15 px; several times what one pair tells
  if (!options_.rows_fit || std::abs(state.cameras[kRowRightRotation]) < kRowsFit_rad) return false;
  options_.rows_fit = false;
  return true;
}

void CalibrationPrior::Reset(CalibrationState* state) const {
  std::copy_n(mean_.data(), kImuCalibrationSize, state->imu.data());
  std::copy_n(mean_.data() + kCameras, kCameraCalibrationSize, state->cameras.data());
}

void CalibrationPrior::AddTo(CalibrationState* state, Prior* prior) const {
  CalibrationState mean;
  Reset(&mean);
  prior->blocks.insert(prior->blocks.end(), {state->imu.data(), state->cameras.data()});
  prior->kinds.insert(prior->kinds.end(), {kImuCalibrationKind, kCameraCalibrationKind});
  prior->x_lin.push_back({mean.imu.begin(), mean.imu.end()});
  prior->x_lin.push_back({mean.cameras.begin(), mean.cameras.end()});
  const Eigen::Index rows = prior->jacobian.rows(), columns = prior->jacobian.cols();
  prior->jacobian.conservativeResizeLike(
      Eigen::MatrixXd::Zero(rows + kCalibrationSize, columns + kCalibrationSize));
  // W with W^T W = covariance^-1.
  const Eigen::LLT<CalibrationMatrix> cholesky(covariance_);
  prior->jacobian.bottomRightCorner<kCalibrationSize, kCalibrationSize>() =
      cholesky.matrixL().solve(CalibrationMatrix::Identity());
  prior->residual.conservativeResizeLike(Eigen::VectorXd::Zero(rows + kCalibrationSize));
}

void CalibrationPrior::Learn(const CalibrationBelief& belief) {
  const CalibrationMatrix known = kRelearned * belief.covariance;
  const Eigen::LLT<CalibrationMatrix> cholesky(known);
  if (!known.allFinite() || cholesky.info() != Eigen::Success) return;
  // Together with what was known at first, which the doubling must not exceed.
  const CalibrationVector first_information = first_sigma_.array().square().inverse() * 0.5;
  CalibrationMatrix information = cholesky.solve(CalibrationMatrix::Identity());
  information.diagonal() += first_information;
  covariance_ = information.llt().solve(CalibrationMatrix::Identity());
  mean_ = belief.mean;
}

std::string CalibrationPrior::BeyondLimit(const CalibrationState& state) const {
  for (const Item& item : kItems) {
    if (IsBeyond(item, options_, AsVector(state))) return item.name;
  }
  return {};
}

void CalibrationPrior::Hold(const CalibrationState& state) {
  if (BeyondLimit(state).empty()) return;
  for (const Item& item : kItems) {
    if (!IsBeyond(item, options_, AsVector(state))) continue;
    options_.*item.estimated = false;
    mean_.segment(item.row, item.count).setZero();
  }
  SetFirstSigma();
}

CalibrationBelief MakeBelief(const CalibrationEstimate& e, const CalibrationOptions& options) {
  CalibrationVector mean, sigma;
  mean << e.imu_rotation_rad, e.lever_m, e.time_offset_s, e.imu_errors, e.right_rotation_rad,
      e.focal_length, e.right_centre_px;
  sigma << e.imu_rotation_sigma_rad, e.lever_sigma_m, e.time_offset_sigma_s, e.imu_errors_sigma,
      e.right_rotation_sigma_rad, e.focal_length_sigma, e.right_centre_sigma_px;
  CalibrationBelief belief = CalibrationPrior(options).belief();
  for (int row = 0; row < kCalibrationSize; ++row) {
    if (sigma[row] == 0) continue;
    belief.mean[row] = mean[row];
    belief.covariance(row, row) = std::pow(sigma[row] / options.sigma_scale, 2);
  }
  return belief;
}

CameraCalibrationBlock MakeCameraBlock(const CalibrationEstimate& estimate) {
  CameraCalibrationBlock block{};
  std::copy_n(estimate.right_rotation_rad.data(), 3, block.begin() + kRowRightRotation);
  block[kRowFocalLength] = estimate.focal_length;
  std::copy_n(estimate.right_centre_px.data(), 2, block.begin() + kRowRightCentre);
  return block;
}

CalibrationEstimate Describe(const CalibrationState& state, const CalibrationMatrix& covariance,
                             double sigma_scale) {
  const CalibrationVector x = AsVector(state);
  CalibrationVector sigma = covariance.diagonal().cwiseSqrt();
  sigma = IsHeld(sigma).select(0, sigma_scale * sigma);
  CalibrationEstimate out;
  out.imu_rotation_rad = x.segment<3>(kRowImuRotation);
  out.lever_m = x.segment<3>(kRowLever);
  out.time_offset_s = x[kRowTimeOffset];
  out.imu_errors = x.segment<kImuErrorsSize>(kRowErrors);
  out.right_rotation_rad = x.segment<3>(kCameras + kRowRightRotation);
  out.focal_length = x[kCameras + kRowFocalLength];
  out.right_centre_px = x.segment<2>(kCameras + kRowRightCentre);
  out.imu_rotation_sigma_rad = sigma.segment<3>(kRowImuRotation);
  out.lever_sigma_m = sigma.segment<3>(kRowLever);
  out.time_offset_sigma_s = sigma[kRowTimeOffset];
  out.imu_errors_sigma = sigma.segment<kImuErrorsSize>(kRowErrors);
  out.right_rotation_sigma_rad = sigma.segment<3>(kCameras + kRowRightRotation);
  out.focal_length_sigma = sigma[kCameras + kRowFocalLength];
  out.right_centre_sigma_px = sigma.segment<2>(kCameras + kRowRightCentre);
  return out;
}

}  // namespace slcmap::odometry
