// The calibration of the rig as the window finds it, on simulated tracks.
#include "odometry/factors/calibration_estimate.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "data/core/math.h"
#include "data/simulator/motion.h"
#include "tests/testing/simulated_odometry.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kTime = kRowTimeOffset;

SimulatedRunOptions NoisyCalibration(uint64_t seed, double sigma_px = 0.5) {
  SimulatedRunOptions options;
  options.odometry.method = Method::kPoints;
  options.odometry.points.max_points = 80;
  options.imu_noise = true;
  options.pixel_sigma_px = sigma_px;
  options.odometry.window.point_sigma_px = sigma_px;
  options.odometry.calibration.lever = options.odometry.calibration.focal_length = true;
  // Without ties it cannot be told from the right camera's turns.
  options.odometry.calibration.confirm = options.odometry.calibration.right_centre = false;
  options.gyro_bias_rad_s << -0.002, 0.02, 0.08;
  options.accel_bias_m_s2 << -0.02, 0.13, 0.08;
  options.seed = seed;
  return options;
}

CalibrationFault AllAtOnce() {
  CalibrationFault fault;
  fault.stamps_late_ns = 20'000'000;
  fault.imu_rotation_rad = kDegree * Vector3d(0.6, -0.5, 0.6);
  fault.right_rotation_rad = kDegree * Vector3d(0.1, -0.15, 0.05);
  fault.focal_length = 0.003;
  return fault;
}

// An accelerometer and a gyroscope that read 3 % too much along axes that are off by half a degree.
ImuErrors Misreading() {
  ImuErrors errors;
  errors << -0.029, -0.031, -0.030, 0.008, -0.005, 0.007, -0.030, -0.028, -0.031, 0.005, -0.007,
      -0.008, 0.006, 0.004, -0.008;
  return errors;
}

// What they misread, and nothing else but what always is.
void EstimateImu(SimulatedRunOptions* options) {
  CalibrationOptions& calibration = options->odometry.calibration;
  calibration.lever = calibration.focal_length = false;
  calibration.imu_scale = calibration.imu_axes = true;
  options->fault.imu_errors = Misreading();
}

// The error of what is found on a run that is never lost.
CalibrationVector FoundError(const SimulatedRunOptions& options) {
  const SimulatedRun run = RunOnSimulatedTracks(options);
  EXPECT_EQ(run.states.back().segment, 0);
  // What is told is what the window has.
  const Vector2d off_px =
      run.run.calibration.back().right_centre_px + options.fault.right_centre_px;
  EXPECT_LT(off_px.norm(), 0.1);
  return run.calibration_error;
}

double RightTurn(const CalibrationVector& x) {
  return x.segment<3>(kCameras + kRowRightRotation).norm();
}
double RightCentre(const CalibrationVector& x) {
  return x.segment<2>(kCameras + kRowRightCentre).norm();
}

// Started in motion.
SimulatedRunOptions Exact() {
  SimulatedRunOptions options = NoisyCalibration(3, 0.2);
  options.imu_noise = false;
  options.imu_rate_hz = 1000;
  options.stand_still_s = 0;
  return options;
}

TEST(Calibration, IsFoundWhereTheTracksAreExact) {
  SimulatedRunOptions options = Exact();
  options.fault = AllAtOnce();
  const CalibrationVector error = FoundError(options);
  EXPECT_LT(error.segment<3>(kRowImuRotation).norm(), 0.05 * kDegree);
  EXPECT_LT(std::abs(error[kTime]), 2e-4);
  EXPECT_LT(RightTurn(error), 0.005 * kDegree);
  EXPECT_LT(std::abs(error[kCameras + kRowFocalLength]), 6e-4);
  EXPECT_LT(error.segment<3>(kRowLever).norm(), 0.004);
}

TEST(Calibration, ScaleAndAxesOfTheImuAreFoundWhereTheTracksAreExact) {
  SimulatedRunOptions options = Exact();
  options.pixel_sigma_px = 0.001;
  EstimateImu(&options);
  const SimulatedRun run = RunOnSimulatedTracks(options);
  EXPECT_EQ(run.states.back().segment, 0);
  EXPECT_LT(LargestPositionError(run), 0.05);
  const ImuErrors error = run.calibration_error.segment<kImuErrorsSize>(kRowErrors);
  // As far as it comes today; what keeps it from 2e-3 and 2 cm is not understood.
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 6e-3) << error.transpose();
}

// Where rows were made to fit before the start, what is left is the turn about y alone.
TEST(Calibration, ATurnThatTheRowsDoNotShowIsFoundWhetherTheyAreBelievedOrNot) {
  for (const bool rows_fit : {false, true}) {
    SimulatedRunOptions options = NoisyCalibration(4, 0.2);
    options.fault.right_rotation_rad = kDegree * Vector3d(0, 0.2, 0);
    options.odometry.calibration.rows_fit = rows_fit;
    options.odometry.calibration.confirm = options.odometry.calibration.right_centre = true;
    const CalibrationVector error = FoundError(options);
    EXPECT_LT(RightTurn(error), 0.01 * kDegree);
    EXPECT_LT(RightCentre(error), 0.05);
  }
}

TEST(Calibration, ARightPrincipalPointIsFoundWhereNoTurnStandsForIt) {
  for (const bool confirm : {false, true}) {
    SimulatedRunOptions options = NoisyCalibration(4, 0.2);
    options.fault.right_centre_px = Vector2d(2, -0.5);
    options.odometry.calibration.right_rotation = false;
    options.odometry.calibration.right_centre = true;
    options.odometry.calibration.confirm = confirm;
    EXPECT_LT(RightCentre(FoundError(options)), 0.1);
  }
}

TEST(Calibration, WhatIsNotAsGivenIsFoundWhereTheRestIsTakenAsSuch) {
  SimulatedRunOptions options = NoisyCalibration(3, 0.2);
  options.odometry.calibration.confirm = true;
  options.fault.focal_length = 0.003;
  options.fault.imu_rotation_rad = kDegree * Vector3d(0.6, -0.5, 0.6);
  const CalibrationVector error = FoundError(options);
  EXPECT_LT(error.segment<3>(kRowImuRotation).norm(), 0.1 * kDegree);
  EXPECT_LT(std::abs(error[kCameras + kRowFocalLength]), 8e-4);
  EXPECT_LT(std::abs(error[kTime]), 2e-4);
}

TEST(Calibration, ScaleAndAxesOfTheImuAreFoundInNoise) {
  SimulatedRunOptions options = NoisyCalibration(5, 0.5);
  options.duration_s = 30;
  options.odometry.calibration.confirm = true;
  EstimateImu(&options);
  const SimulatedRun run = RunOnSimulatedTracks(options);
  EXPECT_EQ(run.states.back().segment, 0);
  const ImuErrors error = run.calibration_error.segment<kImuErrorsSize>(kRowErrors);
  const ImuErrors sigma = run.calibration_sigma.segment<kImuErrorsSize>(kRowErrors);
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 0.01) << error.transpose();
  EXPECT_LT(error.cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 4) << sigma.transpose();
}

TEST(Calibration, IsAsWellKnownAsIsClaimed) {
  double nees = 0;
  constexpr int kRuns = 4;
  for (uint64_t seed = 31; seed < 31 + kRuns; ++seed) {
    SimulatedRunOptions options = NoisyCalibration(seed);
    options.fault = AllAtOnce();
    options.duration_s = 15;
    nees += RunOnSimulatedTracks(options).calibration_nees / kRuns;
  }
  EXPECT_GT(nees, 4);
  EXPECT_LT(nees, 18);
}

TEST(Calibration, StaysAtRest) {
  SimulatedRunOptions options = NoisyCalibration(5);
  options.duration_s = options.stand_still_s = 20;
  const SimulatedRun run = RunOnSimulatedTracks(options);
  ASSERT_GT(run.states.size(), 300u);
  const CalibrationOptions& given = options.odometry.calibration;
  EXPECT_GT(run.calibration_sigma[kTime], 0.95 * given.time_offset_sigma_s);
  EXPECT_LT(std::abs(run.calibration_error[kTime]), 0.2 * given.time_offset_sigma_s);
  EXPECT_GT(run.calibration_sigma.segment<3>(kRowLever).minCoeff(), 0.95 * given.lever_sigma_m);
  EXPECT_LT(run.calibration_error.segment<3>(kRowLever).norm(), 0.2 * given.lever_sigma_m);
  EXPECT_LT(run.calibration_error.segment<3>(kRowImuRotation).norm(),
            0.2 * given.imu_rotation_sigma_rad);
}

// Turning and walking in a plane.
MotionSpline Planar(double duration_s) {
  constexpr double kKnot_s = 0.1;
  const Eigen::Quaterniond R_camera_imu = ExampleStereoRig().T_imu_camera[0].rotation.conjugate();
  std::vector<RigidTransform> control;
  for (double knot_s = -0.2; knot_s < duration_s + 0.1; knot_s += kKnot_s) {
    const double t_s = EasedTime(knot_s - 2, 2), yaw_rad = 0.9 * std::sin(0.8 * t_s);
    control.emplace_back(
        CameraLookingAlong({std::cos(yaw_rad), std::sin(yaw_rad), 0}) * R_camera_imu,
        Vector3d(1.5 * std::sin(0.5 * t_s), std::cos(0.7 * t_s), 0));
  }
  return {kKnot_s, control};
}

// About one axis the lever along it is nobody's to know.
TEST(Calibration, WhatAPlanarMotionDoesNotTellStays) {
  SimulatedRunOptions options = NoisyCalibration(6);
  const MotionSpline motion = Planar(options.duration_s);
  const SimulatedRun run = RunOnSimulatedTracks(options, &motion);
  ASSERT_GT(run.states.size(), 300u);
  const Vector3d up_imu = motion.PoseAt(10).rotation.conjugate() * Vector3d::UnitZ();
  const double sigma_m = options.odometry.calibration.lever_sigma_m;
  const double along_m = up_imu.dot(run.calibration_error.segment<3>(kRowLever));
  EXPECT_LT(std::abs(along_m), 0.3 * sigma_m);
  // The axis is nearly one of the IMU's.
  Vector3d::Index axis;
  up_imu.cwiseAbs().maxCoeff(&axis);
  EXPECT_GT(run.calibration_sigma[kRowLever + axis], 0.9 * sigma_m);
  // The turn tells the time offset.
  EXPECT_LT(run.calibration_sigma[kTime], 0.1 * options.odometry.calibration.time_offset_sigma_s);
}

TEST(Calibration, WhatIsNotToBeEstimatedStays) {
  SimulatedRunOptions options = NoisyCalibration(7);
  options.duration_s = 8;
  CalibrationOptions& calibration = options.odometry.calibration;
  calibration.time_offset = calibration.imu_rotation = calibration.lever = false;
  calibration.right_rotation = calibration.focal_length = false;
  const SimulatedRun run = RunOnSimulatedTracks(options);
  EXPECT_LT(run.calibration_error.cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT(run.calibration_sigma.maxCoeff(), 2e-7);
  // Which is told as held, not as known so well.
  const CalibrationEstimate& told = run.run.calibration.back();
  EXPECT_EQ(told.time_offset_sigma_s, 0);
  EXPECT_EQ(told.focal_length_sigma, 0);
  EXPECT_TRUE(told.right_centre_sigma_px.isZero(0));
  for (const Vector3d& sigma :
       {told.imu_rotation_sigma_rad, told.lever_sigma_m, told.right_rotation_sigma_rad}) {
    EXPECT_TRUE(sigma.isZero(0));
  }
}

TEST(Calibration, AnEstimateBeyondItsLimitIsReportedAndNotUsed) {
  SimulatedRunOptions options = NoisyCalibration(8);
  options.imu_noise = false;
  options.gyro_bias_rad_s.setZero();
  options.fault.stamps_late_ns = 40'000'000;
  options.odometry.calibration.max_time_offset_s = 0.03;
  std::optional<double> predicted_rad, expected_rad;
  bool started = false;
  const SimulatedRun run = RunOnSimulatedTracks(options, nullptr, [&](Estimator* estimator) {
    started = started || !estimator->window().empty();
    if (!started || !estimator->window().empty() || predicted_rad) return;
    // Images are where they were given again: from the last sample on, which is that of the image,
    // the rate is taken to stay.
    const int64_t stamp_ns = estimator->imu().last_stamp_ns();
    predicted_rad = LogRotation(estimator->PredictedCameraRotation(stamp_ns + 50'000'000)).norm();
    expected_rad = 0.05 * estimator->imu().MeanRate(stamp_ns, 1).norm();
  });
  ASSERT_TRUE(predicted_rad);
  EXPECT_GT(*expected_rad, 0.01);
  EXPECT_NEAR(*predicted_rad, *expected_rad, 1e-6);
  int64_t reported = 0;
  for (const auto& [kind, count] : run.run.warnings) {
    if (kind.find("beyond its limit: time offset") != std::string::npos) reported += count;
  }
  EXPECT_EQ(reported, 1);
  EXPECT_LT(std::abs(run.run.calibration.back().time_offset_s), 1e-5);
}

CalibrationState GetState(const CalibrationVector& x) {
  CalibrationState state;
  std::copy_n(x.data(), kImuCalibrationSize, state.imu.data());
  std::copy_n(x.data() + kImuCalibrationSize, kCameraCalibrationSize, state.cameras.data());
  return state;
}

CalibrationVector ComputeMean(const CalibrationPrior& prior) {
  CalibrationState state;
  prior.Reset(&state);
  return AsVector(state);
}

TEST(CalibrationPrior, HoldsWhatIsBeyondItsLimitAndKeepsTheRest) {
  const CalibrationOptions options;
  CalibrationVector known = CalibrationVector::Zero();
  known[kTime] = 0.5 * options.max_time_offset_s;
  known[kRowImuRotation] = 0.5 * options.max_imu_rotation_rad;
  CalibrationPrior prior(options);
  prior.Learn({known, 1e-8 * CalibrationMatrix::Identity()});
  ASSERT_EQ(ComputeMean(prior), known);
  prior.Hold(GetState(known));  // nothing is
  EXPECT_EQ(ComputeMean(prior), known);
  known[kTime] = 2 * options.max_time_offset_s;
  prior.Hold(GetState(known));
  known[kTime] = 0;
  EXPECT_EQ(ComputeMean(prior), known);
}

TEST(CalibrationPrior, WhatAnEstimateTellsIsBelievedAgain) {
  const CalibrationOptions options;
  CalibrationEstimate estimate;
  estimate.focal_length = 0.003;
  estimate.focal_length_sigma = 3e-4;
  estimate.right_centre_px = {2, -1};
  estimate.right_centre_sigma_px = {0.05, 0.04};
  const CalibrationBelief belief = MakeBelief(estimate, options);
  const CalibrationVector given = CalibrationPrior(options).belief().covariance.diagonal();
  EXPECT_EQ(belief.mean[kCameras + kRowFocalLength], 0.003);
  EXPECT_EQ(belief.mean[kCameras + kRowRightCentre + 1], -1);
  EXPECT_NEAR(std::sqrt(belief.covariance(kCameras + kRowFocalLength, kCameras + kRowFocalLength)),
              3e-4 / options.sigma_scale, 1e-12);
  EXPECT_EQ(belief.covariance(kTime, kTime), given[kTime]) << "what the run held";
  const NominalPrior ties(options, belief);
  EXPECT_EQ(ties.weights()[kCameras + kRowFocalLength], 0);
  EXPECT_EQ(ties.weights()[kCameras + kRowRightCentre], 0);
}

// Estimates of an exact rig scatter; taken to be as given, they do so by a fraction.
TEST(Calibration, WhatIsAsGivenIsTakenAsSuch) {
  SimulatedRunOptions options = NoisyCalibration(10);
  const SimulatedRun free = RunOnSimulatedTracks(options);
  options.odometry.calibration.confirm = true;
  const SimulatedRun tied = RunOnSimulatedTracks(options);
  for (const int row : {kTime, kRowImuRotation + 2, kCameras + kRowFocalLength}) {
    EXPECT_LT(std::abs(tied.calibration_error[row]), 0.3 * free.calibration_sigma[row]) << row;
    EXPECT_LT(tied.calibration_sigma[row], 0.3 * free.calibration_sigma[row]) << row;
  }
  // What is told is what is known without ties.
  const CalibrationEstimate& told = tied.run.calibration.back();
  EXPECT_NEAR(told.time_offset_sigma_s,
              options.odometry.calibration.sigma_scale * free.calibration_sigma[kTime],
              0.3 * told.time_offset_sigma_s);
  // Rows that fit leave the right camera's turns about y and z as they were given, but not as known
  // for certain.
  EXPECT_GT(told.right_rotation_sigma_rad.x(), 0);
  EXPECT_GT(told.right_rotation_sigma_rad.tail<2>().minCoeff(), 5e-5);
  EXPECT_LT(told.right_rotation_rad.tail<2>().norm(), 3e-5);
}

TEST(CalibrationPrior, ALaterSegmentStartsFromWhatWasFound) {
  SimulatedRunOptions options = NoisyCalibration(9);
  options.fault = AllAtOnce();
  options.image_gap_from_s = 14;
  options.image_gap_to_s = 17;
  options.duration_s = 19;
  CalibrationVector first = CalibrationVector::Zero();
  RunOnSimulatedTracks(options, nullptr, [&](Estimator* estimator) {
    const WindowState& window = estimator->window().state();
    if (window.frames.empty() || window.frames.back()->stamp_ns < 17'000'000'000) return;
    if (first.isZero()) first = AsVector(estimator->window().calibration());
  });
  const CalibrationVector error = first - options.fault.Expected();
  EXPECT_LT(std::abs(error[kTime]), 1e-3);
  EXPECT_LT(error.segment<3>(kRowImuRotation).norm(), 0.15 * kDegree);
}

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
