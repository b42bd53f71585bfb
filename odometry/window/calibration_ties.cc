#include "odometry/window/calibration_ties.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "odometry/window/calibration_estimate.h"

namespace slcmap {
namespace {

// Odds for and against a number's being as given at which it is tied, and the tie taken off.
constexpr double kTieOdds = 4, kReleaseOdds = 1.0 / 4;
// Of a number's standard deviation to that of its tie: what is left of the scatter is a sixtieth,
// and what is known without the tie can still be told from what is known with it.
constexpr double kTightness = 8;

bool IsRightRotation(int row) {
  const int first = kImuCalibrationSize + kRowRightRotation;
  return row >= first && row < first + 3;
}

}  // namespace

CalibrationTies::CalibrationTies(const CalibrationOptions& options, const CalibrationBelief& known)
    : confirm_(options.confirm),
      rows_fit_(options.rows_fit),
      sigma_scale_(options.sigma_scale),
      given_sigma_(
          IsHeld(known.covariance.diagonal().cwiseSqrt()).select(0, EstimatedSigma(options))) {
  if (!confirm_) return;
  constexpr int kCameras = kImuCalibrationSize;
  const auto tie = [&](int row) {
    if (given_sigma_[row] == 0 || OddsOfGiven(known, row) <= kReleaseOdds) return;
    weights_[row] = kTightness / given_sigma_[row];
  };
  // Nothing tells a focal length before the rig has turned by a lot, nor turns of the right camera
  // about its y, which trade with depth, before it has moved by a lot.
  tie(kCameras + kRowFocalLength);
  if (!options.rows_fit) return;
  for (const int axis : {1, 2}) tie(kCameras + kRowRightRotation + axis);
}

// For its being as it was given.
double CalibrationTies::OddsOfGiven(const CalibrationBelief& belief, int row) const {
  const double sigma = sigma_scale_ * std::sqrt(belief.covariance(row, row));
  const double off = belief.mean[row] / sigma;
  return given_sigma_[row] / sigma * std::exp(-0.5 * off * off);
}

CalibrationBelief CalibrationTies::Without(const CalibrationBelief& with) const {
  if (weights_.isZero(0)) return with;
  // In units of what is known, so that all numbers are alike.
  const CalibrationVector scale = with.covariance.diagonal().cwiseSqrt();
  const CalibrationMatrix scaled =
      scale.cwiseInverse().asDiagonal() * with.covariance * scale.cwiseInverse().asDiagonal();
  const CalibrationMatrix information = scaled.llt().solve(CalibrationMatrix::Identity());
  CalibrationMatrix untied = information;
  untied.diagonal() -= weights_.cwiseProduct(scale).cwiseAbs2();
  const Eigen::LLT<CalibrationMatrix> cholesky(untied);
  if (cholesky.info() != Eigen::Success) return with;
  CalibrationBelief without;
  without.mean = scale.asDiagonal() * cholesky.solve(information * with.mean.cwiseQuotient(scale));
  without.covariance =
      scale.asDiagonal() * cholesky.solve(CalibrationMatrix::Identity()) * scale.asDiagonal();
  return without;
}

void CalibrationTies::Update(const CalibrationBelief& with) {
  if (!confirm_) return;
  const CalibrationBelief belief = Without(with);
  for (int row = 0; row < kCalibrationSize; ++row) {
    if (given_sigma_[row] == 0 || (!rows_fit_ && IsRightRotation(row))) continue;
    const double odds = OddsOfGiven(belief, row);
    const bool tied = odds > (weights_[row] > 0 ? kReleaseOdds : kTieOdds);
    const double weight = kTightness / std::sqrt(belief.covariance(row, row));
    weights_[row] = tied ? std::max(weights_[row], weight) : 0;
  }
}

}  // namespace slcmap
