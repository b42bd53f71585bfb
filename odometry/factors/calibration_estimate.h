// What is known of the rig's calibration, what of it is estimated, and which numbers are taken to
// be as they were given.
#pragma once

#include <Eigen/Core>
#include <string>

#include "odometry/factors/factor.h"
#include "odometry/factors/options.h"
#include "odometry/run/run.h"

namespace slcmap::inline odometry {

// What is known of a calibration's corrections.
struct CalibrationBelief {
  CalibrationVector mean;
  CalibrationMatrix covariance;
};

// A rig that is as it was calibrated gains nothing by estimates that scatter about that. Once what
// the window knows of a number is more likely if it is as given than if it is off as the options
// have it, the number is tied to the given value. Ties stand beside the marginalisation prior and
// never enter it, so what is known without them can be told at any time, and they are taken off
// where that speaks against them. The odds are the Savage-Dickey density ratio (Dickey, "The
// weighted likelihood ratio, linear hypotheses on normal location parameters", Ann. Math. Stat. 42,
// 1971),
//
//   p(x = 0 | data) / p(x = 0) = sigma_given / sigma exp(-x^2 / (2 sigma^2))
//
// with the estimate x and its standard deviation sigma without ties, as much larger than the window
// claims as CalibrationOptions::sigma_scale says. Where rows of the images did not fit, the right
// camera is not as it was given, and its turns are never tied. The right camera's principal point
// does nearly what its turns do: what else is off is judged with it as given, and it where all else
// may be off, so that of the two the turns come first.
class NominalPrior {
 public:
  // With what is known before a segment starts: focal lengths and the right camera's principal
  // point are tied, and where the rows of the images are believed to fit its turns about y and z,
  // unless earlier segments have found them off. What else earlier ones have tied has to be found
  // anew, since the rig may have been touched.
  NominalPrior(const CalibrationOptions& options, const CalibrationBelief& known);

  // One over the standard deviation of a number's tie to the given value; 0 where it has none.
  const CalibrationVector& weights() const { return weights_; }

  double sigma_scale() const { return sigma_scale_; }

  // What is known without the ties, given what is known with them.
  CalibrationBelief Without(const CalibrationBelief& with) const;

  // Ties, and takes ties off, by what is known with those there are.
  void Update(const CalibrationBelief& with);

 private:
  double OddsOfGiven(const CalibrationBelief& belief, int row) const;
  CalibrationBelief Without(const CalibrationVector& weights, const CalibrationBelief& with) const;

  bool confirm_;
  bool rows_fit_;  // else the right camera's turns are not as they were given, whatever they are
  double sigma_scale_;
  CalibrationVector given_sigma_;  // 0 of what is held
  CalibrationVector weights_ = CalibrationVector::Zero();
};

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
  bool RejectRows(const CalibrationState& state);

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
CalibrationBelief MakeBelief(const CalibrationEstimate& estimate,
                             const CalibrationOptions& options);

// What an estimate says of the cameras, as a block.
CameraCalibrationBlock MakeCameraBlock(const CalibrationEstimate& estimate);

// The estimate with its standard deviations, these scaled; 0 of what is held.
CalibrationEstimate Describe(const CalibrationState& state, const CalibrationMatrix& covariance,
                             double sigma_scale);

}  // namespace slcmap::odometry
