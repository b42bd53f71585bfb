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

double TightnessOf(int row) { return IsRightCentre(row) ? kCentreTightness : kTightness; }

}  // namespace

CalibrationTies::CalibrationTies(const CalibrationOptions& options, const CalibrationBelief& known)
    : confirm_(options.confirm),
      rows_fit_(options.rows_fit),
      sigma_scale_(options.sigma_scale),
      given_sigma_(
          IsHeld(known.covariance.diagonal().cwiseSqrt()).select(0, EstimatedSigma(options))) {
  if (!confirm_) return;
  const auto tie = [&](int row) {
    if (given_sigma_[row] == 0 || OddsOfGiven(known, row) <= kReleaseOdds) return;
    weights_[row] = TightnessOf(row) / given_sigma_[row];
  };
  // Nothing tells a focal length before the rig has turned by a lot, nor turns of the right camera
  // about its y and its principal point, which trade with depth, before it has moved by a lot.
  tie(kCameras + kRowFocalLength);
  for (const int axis : {0, 1}) tie(kCameras + kRowRightCentre + axis);
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
  return Without(weights_, with);
}

CalibrationBelief CalibrationTies::Without(const CalibrationVector& weights,
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

void CalibrationTies::Update(const CalibrationBelief& with) {
  if (!confirm_) return;
  CalibrationVector but_centre = weights_;
  but_centre.segment<2>(kCameras + kRowRightCentre).setZero();
  const CalibrationBelief untied = Without(with), centred = Without(but_centre, with);
  for (int row = 0; row < kCalibrationSize; ++row) {
    if (given_sigma_[row] == 0 || (!rows_fit_ && IsRightRotation(row))) continue;
    const CalibrationBelief& belief = IsRightCentre(row) ? untied : centred;
    const double odds = OddsOfGiven(belief, row);
    const bool tied = odds > (weights_[row] > 0 ? kReleaseOdds : kTieOdds);
    const double weight = TightnessOf(row) / std::sqrt(belief.covariance(row, row));
    // So that it can be taken off again, whatever the belief was.
    const double most = TightnessOf(row) / (kLeastSigma * given_sigma_[row]);
    weights_[row] = tied ? std::min(std::max(weights_[row], weight), most) : 0;
  }
}

}  // namespace slcmap
