// Which numbers of the calibration are taken to be as they were given.
#pragma once

#include "odometry/window/calibration_options.h"
#include "odometry/residuals/calibration.h"

namespace slcmap {

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
class CalibrationTies {
 public:
  // With what is known before a segment starts: focal lengths and the right camera's principal
  // point are tied, and where the rows of the images are believed to fit its turns about y and z,
  // unless earlier segments have found them off. What else earlier ones have tied has to be found
  // anew, since the rig may have been touched.
  CalibrationTies(const CalibrationOptions& options, const CalibrationBelief& known);

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

}  // namespace slcmap
