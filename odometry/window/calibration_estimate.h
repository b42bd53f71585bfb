// What is known of the rig's calibration, and what of it is estimated.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "odometry/window/calibration_options.h"
#include "odometry/residuals/calibration.h"
#include "odometry/residuals/prior.h"
#include "odometry/run.h"
#include "odometry/window/calibration_ties.h"

namespace slcmap {

CalibrationVector AsVector(const CalibrationState& state);

// The standard deviations of what was given, 0 of what is not estimated.
CalibrationVector EstimatedSigma(const CalibrationOptions& options);

// Which numbers are held, by the standard deviations that a prior gives them.
using CalibrationFlags = Eigen::Array<bool, kCalibrationSize, 1>;
CalibrationFlags IsHeld(const CalibrationVector& sigma);

// What a window starts from: at first that the calibration was given with the options' standard
// deviations, in later segments what earlier ones have found. What is not estimated is held.
class CalibrationPrior {
 public:
  explicit CalibrationPrior(const CalibrationOptions& options);

  // Sets the state to where the prior has it.
  void Reset(CalibrationState* state) const;

  // The rows of the prior on the blocks of `state`, wherever these are, appended to those that
  // `prior` has.
  void AddTo(CalibrationState* state, Prior* prior) const;

  // Takes over what a window knows, with a covariance that is doubled since the rig may have been
  // touched, and at most that of the options.
  void Learn(const CalibrationBelief& belief);

  // True where the rows of the rectified images, which options believe to fit, turn out not to, by
  // the estimated turn of the right camera about x; options() has that from then on.
  bool DisbelieveRows(const CalibrationState& state);

  // What is known before a window starts, and what of it is estimated.
  CalibrationBelief belief() const { return {mean_, covariance_}; }
  const CalibrationOptions& options() const { return options_; }

  // Which estimate is beyond its limit, in words; empty where none is. Hold() puts the items that
  // are back to the given value, for good.
  std::string BeyondLimit(const CalibrationState& state) const;
  void Hold(const CalibrationState& state);

 private:
  void SetFirstSigma();

  CalibrationOptions options_;
  CalibrationVector mean_ = CalibrationVector::Zero(), first_sigma_;
  CalibrationMatrix covariance_;
};

// What an estimate tells, number by number; of what was held, what was given.
CalibrationBelief BeliefOf(const CalibrationEstimate& estimate, const CalibrationOptions& options);

// What an estimate says of the cameras, as a block.
CameraCalibrationBlock CameraBlockOf(const CalibrationEstimate& estimate);

// The estimate with its standard deviations, these scaled; 0 of what is held.
CalibrationEstimate Describe(const CalibrationState& state, const CalibrationMatrix& covariance,
                             double sigma_scale);

}  // namespace slcmap
