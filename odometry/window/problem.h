// The terms of a window's cost, one Add...() a kind, and how well measurements fit the states that
// were estimated from them.
// Brings what frames measured before or after their stamps (see odometry/geometry/exposure.h) to
// these, by what is known of their motion and of the depth of what they show.
#pragma once

#include <ceres/loss_function.h>
#include <ceres/problem.h>

#include <array>
#include <memory>
#include <vector>

#include "odometry/factors/factor.h"
#include "odometry/geometry/exposure.h"
#include "odometry/window/window_state.h"

namespace slcmap::inline odometry {

// One term and the parameter blocks that it binds.
template <typename Number>
struct BasicTerm {
  std::unique_ptr<Factor> factor;
  ceres::LossFunction* loss = nullptr;  // not owned; null for none
  std::array<Number*, Factor::kMaxBlocks> blocks{};
};
using Term = BasicTerm<double>;             // a solver may move the blocks
using FixedTerm = BasicTerm<const double>;  // it is evaluated where they are

// What the terms need beside the states; must outlive them.
struct CostModel {
  StereoGeometry geometry;  // with the weight of points
  StereoGeometry lines;     // the same with the weight of lines
  std::unique_ptr<ceres::LossFunction> point_loss, line_loss, point_on_line_loss, along_axis_loss;
  double point_on_line_sigma_m = 0.05;
  double zero_velocity_sigma_m_s = 0.02;
  // What all terms bind of the rig. Blocks at a fixed address, without a linearisation point: what
  // cannot be observed of the poses, position and heading, cannot wherever these are evaluated.
  std::unique_ptr<CalibrationState> calibration = std::make_unique<CalibrationState>();

  // How much longer than given the readout of rolling shutters is, in s: another such block; null
  // where that is not estimated.
  std::unique_ptr<double> readout;

  // One over the standard deviations of ties of the calibration to what was given; 0 for none.
  CalibrationVector calibration_ties = CalibrationVector::Zero();

  // As it is estimated, for what takes the cameras as known.
  StereoGeometry Corrected(const StereoGeometry& given) const {
    return given.CorrectedBy(calibration->cameras.data());
  }
};

void AddImuTerm(FrameState* from, FrameState* to, const CostModel& model, std::vector<Term>* terms);
void AddZeroVelocityTerm(FrameState* frame, const CostModel& model, std::vector<Term>* terms);
// The term of one observation of a triangulated landmark.
void AddPointTerm(PointLandmark* landmark, FrameState* frame, const CostModel& model,
                  std::vector<Term>* terms);
// All observations of a landmark.
void AddPointTerms(PointLandmark* landmark, const CostModel& model, std::vector<Term>* terms);

// The term of one observation of an estimated line.
void AddLineTerm(LineLandmark* line, FrameState* frame, const CostModel& model,
                 std::vector<Term>* terms);
// The term that holds a triangulated point to an estimated structural line.
void AddPointOnLineTerm(PointLandmark* landmark, LineLandmark* line, const CostModel& model,
                        std::vector<Term>* terms);
// The term that ties the direction of an estimated line to its axis or slope, where it may deviate
// from it.
void AddAlongAxisTerm(LineLandmark* line, const CostModel& model, std::vector<Term>* terms);
void AddSharedDeviationTerm(SharedDeviation* shared, std::vector<Term>* terms);

// All terms of a window but its prior.
std::vector<Term> BuildTerms(WindowState* window, const CostModel& model);

// The same terms where nothing is to be moved.
FixedTerm FixedPointTerm(const PointLandmark& landmark, const FrameState& frame,
                         const CostModel& model);
std::vector<FixedTerm> FixedPointTerms(const PointLandmark& landmark, const CostModel& model);
FixedTerm FixedLineTerm(const LineLandmark& line, const FrameState& frame, const CostModel& model);
FixedTerm FixedAlongAxisTerm(const LineLandmark& line, const CostModel& model);
std::vector<FixedTerm> FixedTerms(const WindowState& window, const CostModel& model);

// Of the IMU's measurement between two states.
struct ImuFit {
  double chi2 = 0;               // squared residual of a row, by its variance: 1 as claimed
  double turn_rate_rad_s = 0;    // residual of the turn over the time between
  double acceleration_m_s2 = 0;  // the same of the velocity
};

// `to.from_previous` leads from one to the other.
ImuFit MeasureImuFit(const CostModel& model, const FrameState& from, const FrameState& to);

// Of observations of points whose place is known, each by one camera.
struct PointFit {
  int observations = 0;
  int rejected = 0;  // of them
  double chi2 = 0;   // squared residuals by their variances, sum over those that are kept

  void Add(double observation_chi2, double max_chi2) {
    ++observations;
    rejected += observation_chi2 > max_chi2;
    chi2 += observation_chi2 > max_chi2 ? 0 : observation_chi2;
  }
};

// Of an image that was estimated alone against the window.
struct FrameFit {
  ImuFit imu;      // from the newest keyframe
  int points = 0;  // that it shows and the window knows
  int rejected = 0;
};

// Of a window that was optimised with a new keyframe.
struct WindowFit {
  double imu_chi2 = 0;  // mean over the intervals between its keyframes
  PointFit points;
  // That the new keyframe shows in the first camera, and in the right image too.
  int newest_points = 0, newest_right = 0;
};

// All but the points, which are judged where they are rejected.
WindowFit MeasureWindowFit(const CostModel& model, const WindowState& window);

// How the body moves about the moment of a frame, as its state and what the IMU felt have it.
BodyMotion GetMotion(const FrameState& frame, const CalibrationState& calibration);

// Where a measurement would have been at the stamp: so placed, it has in a term of the window the
// residual that it has at its own time, by the states as they are. To be done again where they have
// changed. Where the readout is estimated, how it moves with that is told, too. Of what is not
// placed yet a depth is taken that both images of the frame show, or else that of what they show
// around it. Does nothing where all was exposed at the stamp.
void BringToStamp(const WindowState& window, const CostModel& model, FrameState* frame);

// Of all frames of the window.
void BringToStamps(const CostModel& model, WindowState* window);

}  // namespace slcmap::odometry
