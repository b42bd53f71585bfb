// The sliding window of keyframes: what is known of the recent past, and how it is kept consistent.
#pragma once

#include <unordered_set>
#include <vector>

#include "odometry/factors/calibration_estimate.h"
#include "odometry/geometry/imu.h"
#include "odometry/run/run.h"
#include "odometry/window/marginalization.h"
#include "odometry/window/options.h"
#include "odometry/window/point_landmarks.h"
#include "odometry/window/problem.h"
#include "odometry/window/solver.h"
#include "odometry/window/structure.h"
#include "odometry/window/window_state.h"

namespace slcmap::inline odometry {

// Landmarks that are no longer known, as outliers or because they have left: their tracks must end.
struct FinishedIds {
  std::unordered_set<int64_t> points, lines;
};

class SlidingWindow {
 public:
  SlidingWindow(const EstimatorOptions& options, const Rig& rectified_rig);

  // How images move with what the lenses are; ideal pinholes without.
  void SetLensShifts(const std::vector<LensShift>& shifts);

  // Starts anew with frames that an initialiser has given first estimates, oldest first. The prior
  // fixes position and heading of the first (the four freedoms that nothing observes) and holds its
  // tilt, speed and biases within the standard deviations of the options. Returns the lines that do
  // not fit.
  FinishedIds Start(std::vector<std::unique_ptr<FrameState>> frames);

  // Forgets everything; what had left the window is kept for Collect(). The calibration is that of
  // the prior again.
  void Clear();

  // What is known of the calibration before any image; to go back to once a start has failed,
  // which forgets everything as Clear() does.
  const CalibrationPrior& calibration_prior() const { return calibration_prior_; }
  void ResetCalibration(const CalibrationPrior& prior);

  // The calibration that is estimated now is where later segments start.
  void LearnCalibration();

  // Which item of the calibration is beyond its limit, in words; empty where none is. Such items
  // are not estimated any longer once HoldCalibration() was called, which later segments start
  // with.
  std::string CalibrationBeyondLimit() const;
  void HoldCalibration();

  // Cuts the samples between keyframes anew, so that those for the estimated time of exposure are
  // so much after the stamps. Frames that rest, the one that the prior knows, and those whose
  // samples the buffer does not have, stay as they are.
  void CutAgain(const ImuBuffer& imu, int64_t offset_ns);

  // The state at the end of a preintegration that starts at the newest keyframe.
  void Predict(FrameState* frame) const;

  // Brings what a frame measured to its stamp, by its state as it is (see
  // odometry/window/at_stamp.h).
  void BringToStamp(FrameState* frame) const;

  // Estimates a frame alone against the window as it is, and rejects what does not fit then; `fit`
  // becomes how well it fits.
  std::unordered_set<int64_t> Track(FrameState* frame, FrameFit* fit = nullptr) const;

  // Takes measurements out of a frame that are far from where its pose and the landmarks have them;
  // returns the ids of those whose left one was.
  std::unordered_set<int64_t> RejectMisfits(FrameState* frame) const;

  // Makes the frame the newest keyframe: triangulates, optimises everything, rejects measurements
  // that do not fit, and marginalises what has become too old.
  FinishedIds AddKeyframe(std::unique_ptr<FrameState> frame);

  // The rig has not moved since the newest keyframe: it is taken to show the rig at a later stamp,
  // which the samples (from its cut to the one given) lead to. So standing still neither pushes
  // keyframes with parallax out of the window nor leaves a long integration behind: of a long rest
  // the newest part is kept. Returns the ids of landmarks that do not fit: their tracks must end.
  std::unordered_set<int64_t> ExtendStandstill(const std::vector<ImuSample>& samples,
                                               int64_t stamp_ns, const ImuCut& cut);

  bool empty() const { return state_.frames.empty(); }
  const WindowState& state() const { return state_; }
  const FrameState& newest() const { return *state_.frames.back(); }
  const CostModel& model() const { return model_; }
  const Structure& structure() const { return structure_; }

  const CalibrationState& calibration() const { return *model_.calibration; }

  // What the last optimisation knew of the states.
  const StateInformation& information() const { return information_; }

  // Moves what has left the window since the last call to the run, as part of a segment.
  void Collect(int segment, OdometryRun* run);

  // Adds what is still in the window to the run.
  void AddContents(int segment, OdometryRun* run) const;

  const WindowFit& fit() const { return fit_; }  // as the last keyframe was added

  bool last_solve_usable() const { return last_solve_usable_; }
  int64_t iterations() const { return iterations_; }  // of the optimisations in AddKeyframe()

 private:
  void SetFirstPrior();
  void AddReadout(Prior* prior) const;
  SolverSummary Optimize(int max_iterations);
  FinishedIds RejectOutliers();
  std::unordered_set<int64_t> RejectPoints();
  void RepropagateMoved();
  void MarginalizeOldest(FinishedIds* finished);
  void ReleaseFromOldest(const WindowCovariance& covariance, PointLandmark* landmark,
                         std::vector<Term>* terms, std::unordered_set<int64_t>* finished);
  void SetPrior(Prior prior);
  bool CanCutAgain(size_t frame, const ImuBuffer& imu, int64_t offset_ns) const;
  // Nothing before the first optimisation.
  std::optional<CalibrationBelief> CalibrationKnown(const WindowCovariance& covariance) const;
  void DescribeCalibration(int segment, const WindowCovariance& covariance,
                           std::vector<CalibrationEstimate>* out) const;
  Keyframe DescribeFrame(const FrameState& frame) const;

  WindowOptions options_;
  PointTriangulationOptions first_triangulation_;  // of the states that a start is given
  Rig rig_;
  CostModel model_;
  Structure structure_;
  CalibrationPrior calibration_prior_;
  NominalPrior calibration_ties_;
  std::optional<CalibrationBelief> known_calibration_;  // when the oldest keyframe left
  WindowState state_;
  StateInformation information_;
  std::vector<Keyframe> left_keyframes_;
  std::vector<Landmark> left_landmarks_;
  std::vector<CalibrationEstimate> left_calibration_;
  bool last_solve_usable_ = true;
  int64_t iterations_ = 0;
  WindowFit fit_;
};

}  // namespace slcmap::odometry
