#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "odometry/factors/calibration_estimate.h"

namespace slcmap {
namespace {

constexpr int kTimeRow = kRowTimeOffset, kFocalRow = kCameras + kRowFocalLength;
constexpr int kTurnRow = kCameras + kRowRightRotation, kAboutY = kTurnRow + 1;
constexpr int kCentreRow = kCameras + kRowRightCentre;

CalibrationOptions Options() {
  CalibrationOptions options;
  options.right_rotation = options.right_centre = false;
  return options;
}

// Lets rows be known to a standard deviation.
void Doubt(int row, int size, double sigma, CalibrationBelief* belief) {
  belief->covariance.diagonal().segment(row, size).setConstant(sigma * sigma);
}

// Of what was given alone, but for one number that is known to be at `mean`.
CalibrationBelief Known(const CalibrationOptions& options, int row, double mean, double sigma) {
  CalibrationBelief belief{CalibrationVector::Zero(), CalibrationMatrix::Identity() * 1e-14};
  Doubt(kRowImuRotation, 3, options.imu_rotation_sigma_rad, &belief);
  Doubt(kTimeRow, 1, options.time_offset_sigma_s, &belief);
  Doubt(kFocalRow, 1, options.focal_length_sigma, &belief);
  if (options.right_rotation) Doubt(kTurnRow, 3, options.right_rotation_sigma_rad, &belief);
  if (options.right_centre) Doubt(kCentreRow, 2, options.right_centre_sigma_px, &belief);
  belief.mean[row] = mean;
  Doubt(row, 1, sigma, &belief);
  return belief;
}

// What is known once ties are added.
CalibrationBelief Tied(const CalibrationBelief& without, const CalibrationVector& weights) {
  const CalibrationMatrix information = without.covariance.inverse();
  CalibrationMatrix tied = information;
  tied.diagonal() += weights.cwiseAbs2();
  const Eigen::LLT<CalibrationMatrix> cholesky(tied);
  return {cholesky.solve(information * without.mean),
          cholesky.solve(CalibrationMatrix::Identity())};
}

CalibrationBelief AtFirst(const CalibrationOptions& options) {
  return Known(options, kTimeRow, 0, options.time_offset_sigma_s);
}

// In a later segment: a focal length that earlier ones have found off is not tied to the given one,
// and what they have tied is not either, since the rig may have been touched.
TEST(NominalPrior, ALaterSegmentStartsFromWhatIsKnown) {
  const CalibrationOptions options = Options();
  EXPECT_EQ(NominalPrior(options, Known(options, kFocalRow, -0.003, 0.0003)).weights().norm(), 0);
  const NominalPrior known(options, Known(options, kTimeRow, 0, 1e-5));
  EXPECT_EQ(known.weights()[kTimeRow], 0);
  EXPECT_GT(known.weights()[kFocalRow], 0);
}

TEST(NominalPrior, WhatTurnsOutToBeAsGivenIsTied) {
  const CalibrationOptions options = Options();
  NominalPrior ties(options, AtFirst(options));
  EXPECT_EQ(ties.weights()[kTimeRow], 0);
  EXPECT_GT(ties.weights()[kFocalRow], 0);
  const auto told = [&](double mean, double sigma) {
    ties.Update(Tied(Known(options, kTimeRow, mean, sigma), ties.weights()));
    return ties.weights()[kTimeRow];
  };
  EXPECT_EQ(told(0.001, 0.01), 0);  // known too little
  EXPECT_EQ(told(0.005, 0.001), 0);
  EXPECT_GT(told(0.001, 0.001), 1 / 0.001);
  EXPECT_GT(told(0.001, 0.001), 1 / 0.001);
}

// What the check before the start found of the right camera is near, but not exact.
TEST(NominalPrior, WhereRowsDidNotFitTheRightCameraIsNeverTied) {
  CalibrationOptions options = Options();
  options.right_rotation = true;
  for (const bool rows_fit : {true, false}) {
    options.rows_fit = rows_fit;
    CalibrationBelief known = AtFirst(options);
    NominalPrior ties(options, known);
    EXPECT_EQ(ties.weights()[kAboutY] > 0, rows_fit);
    known.mean[kAboutY] = 1e-5;
    for (const int row : {kAboutY, kTimeRow}) Doubt(row, 1, 1e-5, &known);
    ties.Update(Tied(known, ties.weights()));
    EXPECT_EQ(ties.weights()[kAboutY] > 0, rows_fit);
    EXPECT_GT(ties.weights()[kTimeRow], 0) << "other numbers are tied all the same";
  }
}

// Either explains what the images show: of the two the turn is taken, and the principal point only
// where the turn does not do.
TEST(NominalPrior, OfTwoExplanationsTheTurnComesFirst) {
  CalibrationOptions options = Options();
  options.right_rotation = options.right_centre = true;
  const auto told = [&](double turn_rad, double centre_px, double centre_sigma_px) {
    CalibrationBelief known = AtFirst(options);
    NominalPrior ties(options, known);
    EXPECT_GT(ties.weights()[kAboutY], 0);
    EXPECT_GT(ties.weights()[kCentreRow], 0);
    // Their sum is known well, in px of a focal length of 400.
    constexpr double kPerRad = 400, kSumSigma_px = 0.02;
    known.mean[kAboutY] = turn_rad;
    known.mean[kCentreRow] = centre_px;
    Doubt(kCentreRow, 1, centre_sigma_px, &known);  // and the turn is whatever the centre is not
    Doubt(kAboutY, 1, std::hypot(centre_sigma_px, kSumSigma_px) / kPerRad, &known);
    known.covariance(kAboutY, kCentreRow) = known.covariance(kCentreRow, kAboutY) =
        -centre_sigma_px * centre_sigma_px / kPerRad;
    ties.Update(Tied(known, ties.weights()));
    return std::pair{ties.weights()[kAboutY] > 0, ties.weights()[kCentreRow] > 0};
  };
  EXPECT_EQ(told(0, 0, 0.8), std::pair(true, true));
  EXPECT_EQ(told(0.0008, 0.3, 0.8), std::pair(false, true));
  EXPECT_EQ(told(0.0008, 2, 0.2), std::pair(false, false));
}

TEST(NominalPrior, ATieGoesWhereItTurnsOutToBeWrong) {
  const CalibrationOptions options = Options();
  NominalPrior ties(options, AtFirst(options));
  const auto told = [&](double mean, double sigma) {
    ties.Update(Tied(Known(options, kFocalRow, mean, sigma), ties.weights()));
    return ties.weights()[kFocalRow];
  };
  EXPECT_GT(told(0.003, options.focal_length_sigma), 0);
  EXPECT_GT(told(0.0005, 0.0002), 0);
  EXPECT_EQ(told(0.003, 0.0004), 0);
}

TEST(NominalPrior, WhatIsKnownWithoutThemCanBeTold) {
  const CalibrationOptions options = Options();
  NominalPrior ties(options, AtFirst(options));
  ties.Update(Tied(Known(options, kTimeRow, 0.0005, 0.0004), ties.weights()));
  ASSERT_GT(ties.weights()[kTimeRow], 0);  // beside the focal length
  CalibrationBelief known = Known(options, kTimeRow, 0.0005, 0.0004);
  known.mean[kFocalRow] = 0.001;
  const double shared = 0.6 * 0.0004 * options.focal_length_sigma;
  known.covariance(kTimeRow, kFocalRow) = known.covariance(kFocalRow, kTimeRow) = shared;
  const CalibrationBelief with = Tied(known, ties.weights());
  EXPECT_LT(std::abs(with.mean[kTimeRow]), 0.1 * known.mean[kTimeRow]);
  const CalibrationBelief without = ties.Without(with);
  EXPECT_NEAR(without.mean[kTimeRow], known.mean[kTimeRow], 1e-9);
  EXPECT_NEAR(without.mean[kFocalRow], known.mean[kFocalRow], 1e-9);
  EXPECT_NEAR(without.covariance(kTimeRow, kFocalRow), shared, 1e-6 * shared);
}

TEST(NominalPrior, ThereAreNoneOfWhatIsHeldNorWhereNoneAreWanted) {
  CalibrationOptions options = Options();
  options.focal_length = options.time_offset = false;
  NominalPrior of_held(options, AtFirst(options));
  of_held.Update(Known(options, kTimeRow, 0, 1e-5));
  EXPECT_EQ(of_held.weights().norm(), 0);
  options = Options();
  options.confirm = false;
  NominalPrior none(options, AtFirst(options));
  none.Update(Known(options, kTimeRow, 0, 1e-5));
  EXPECT_EQ(none.weights().norm(), 0);
}

}  // namespace
}  // namespace slcmap
