#include "odometry/window/sliding_window.h"

#include <algorithm>
#include <deque>
#include <utility>

#include "odometry/geometry/pinhole.h"
#include "odometry/window/line_priors.h"
#include "odometry/window/point_landmarks.h"
#include "odometry/window/window_state.h"

namespace slcmap::inline odometry {
namespace {

using Eigen::Vector3d;

constexpr double kPointLossSigma = 1.0;    // where the Huber loss turns linear
constexpr int kMaxTrackingIterations = 4;  // of a frame between keyframes
// First prior of a segment.
constexpr double kFirstTiltSigma_rad = 0.2;
constexpr double kFirstVelocitySigma_m_s = 2.0;
constexpr double kFirstGyroBiasSigma_rad_s = 0.1;
constexpr double kFirstAccelBiasSigma_m_s2 = 0.2;

// Biases further than this from where an interval was integrated make its correction inexact.
constexpr double kGyroBiasMoved_rad_s = 0.005;
constexpr double kAccelBiasMoved_m_s2 = 0.1;
constexpr double kErrorsMoved = 0.003;            // the same of the IMU's linear errors
constexpr int64_t kRestKept_ns = 10'000'000'000;  // of a standstill; cut when twice as long

// One camera, whose scale comes from the IMU alone, tells no more of the rig than the time offset.
CalibrationOptions WhatTells(const EstimatorOptions& options, const Rig& rig) {
  CalibrationOptions calibration = options.calibration;
  if (UsesRight(options.method, rig)) return calibration;
  calibration.imu_rotation = calibration.lever = calibration.focal_length = false;
  calibration.imu_scale = calibration.imu_axes = false;
  return calibration;
}

// Without a second camera the first states are off by more than points are when they are placed;
// what does not fit once they are optimised is rejected as ever.
PointTriangulationOptions FirstTriangulation(const EstimatorOptions& options, const Rig& rig) {
  constexpr double kWider = 8;
  PointTriangulationOptions first = options.window.triangulation;
  if (!UsesRight(options.method, rig)) first.max_residual_sigma *= kWider;
  return first;
}

bool NoneConstant(const double*) { return false; }

// The landmarks with a known position that a frame sees.
std::vector<const PointLandmark*> KnownLandmarks(const FrameState& frame,
                                                 const WindowState& window) {
  std::vector<const PointLandmark*> known;
  for (const auto& [id, measurement] : frame.measurements) {
    const auto it = window.landmarks.find(id);
    if (it != window.landmarks.end() && it->second.triangulated) known.push_back(&it->second);
  }
  return known;
}

}  // namespace

SlidingWindow::SlidingWindow(const EstimatorOptions& options, const Rig& rectified_rig)
    : options_(options.window),
      first_triangulation_(FirstTriangulation(options, rectified_rig)),
      rig_(rectified_rig),
      structure_(options, rectified_rig),
      calibration_prior_(WhatTells(options, rectified_rig)),
      calibration_ties_(calibration_prior_.options(), calibration_prior_.belief()) {
  const double focal_px = rig_.cameras[0].fx_px;
  const LineLandmarkOptions& lines = options.line_landmarks;
  model_.geometry = StereoGeometry(rig_.T_imu_camera, focal_px / options_.point_sigma_px);
  model_.lines = StereoGeometry(rig_.T_imu_camera, focal_px / lines.sigma_px);
  model_.point_loss = std::make_unique<ceres::HuberLoss>(kPointLossSigma);
  model_.line_loss = std::make_unique<ceres::HuberLoss>(lines.loss_sigma);
  model_.point_on_line_loss = std::make_unique<ceres::CauchyLoss>(lines.loss_sigma);
  model_.along_axis_loss = std::make_unique<ceres::CauchyLoss>(kDeviationLossSigma);
  model_.point_on_line_sigma_m = lines.point_sigma_m;
  model_.zero_velocity_sigma_m_s = options_.zero_velocity_sigma_m_s;
  model_.calibration_ties = calibration_ties_.weights();
  if (options.calibration.readout) model_.readout = std::make_unique<double>(0);
}

void SlidingWindow::SetLensShifts(const std::vector<LensShift>& shifts) {
  model_.geometry.lens_shifts = model_.lines.lens_shifts =
      std::make_shared<const std::vector<LensShift>>(shifts);
}

FinishedIds SlidingWindow::Start(std::vector<std::unique_ptr<FrameState>> frames) {
  const CalibrationState estimated = calibration();
  Clear();
  *model_.calibration = estimated;
  for (auto& frame : frames) {
    state_.frames.push_back(std::move(frame));
    RegisterPoints(state_.frames.back().get(), &state_);
    RegisterLines(state_.frames.back().get(), &state_);
  }
  FrameState* newest = state_.frames.back().get();
  SetFirstPrior();
  BringToStamps(model_, &state_);
  TriangulatePoints(first_triangulation_, model_.Corrected(model_.geometry), &state_);
  Optimize(5 * options_.max_iterations);
  if (calibration_prior_.RejectRows(calibration())) {
    calibration_ties_ = NominalPrior(calibration_prior_.options(), calibration_prior_.belief());
    model_.calibration_ties = calibration_ties_.weights();
    SetFirstPrior();
    Optimize(5 * options_.max_iterations);
  }
  TriangulatePoints(options_.triangulation, model_.Corrected(model_.geometry), &state_);
  structure_.Update(model_, newest, &state_);
  Optimize(5 * options_.max_iterations);
  return RejectOutliers();
}

FinishedIds SlidingWindow::RejectOutliers() {
  FinishedIds finished;
  finished.points = RejectPoints();
  finished.lines = structure_.Judge(model_, newest(), &state_);
  return finished;
}

// Landmarks that do not fit, which leave their lines too.
std::unordered_set<int64_t> SlidingWindow::RejectPoints() {
  std::unordered_set<int64_t> outliers =
      RejectPointOutliers(kMaxPointChi2, model_, &state_, &fit_.points);
  structure_.RemovePoints(outliers, &state_);
  return outliers;
}

void SlidingWindow::SetFirstPrior() {
  // Position and heading are free to choose: their deviations only have to be small against what
  // matters, and large enough to keep the system well conditioned.
  constexpr double kGaugeSigma_m = 1e-3, kGaugeSigma_rad = 1e-4;
  FrameState& first = *state_.frames.front();
  Prior prior;
  prior.blocks = {first.pose.data(), first.speed_bias.data()};
  prior.kinds = {kPoseKind, kSpeedBiasKind};
  prior.x_lin = {{first.pose.begin(), first.pose.end()},
                 {first.speed_bias.begin(), first.speed_bias.end()}};
  Vector3d rotation_weight = Vector3d::Constant(1.0 / kFirstTiltSigma_rad);
  rotation_weight.z() = 1.0 / kGaugeSigma_rad;
  prior.jacobian = Eigen::MatrixXd::Zero(15, 15);
  prior.jacobian.diagonal().head<3>().setConstant(1.0 / kGaugeSigma_m);
  // Tilt and heading are turns about world axes: R delta.
  prior.jacobian.block<3, 3>(3, 3) =
      rotation_weight.asDiagonal() * first.T_world_imu().rotation.toRotationMatrix();
  prior.jacobian.diagonal().segment<3>(6).setConstant(1.0 / kFirstVelocitySigma_m_s);
  prior.jacobian.diagonal().segment<3>(9).setConstant(1.0 / kFirstGyroBiasSigma_rad_s);
  prior.jacobian.diagonal().segment<3>(12).setConstant(1.0 / kFirstAccelBiasSigma_m_s2);
  prior.residual = Eigen::VectorXd::Zero(15);
  calibration_prior_.AddTo(model_.calibration.get(), &prior);
  if (model_.readout) AddReadout(&prior);
  state_.prior = std::move(prior);
}

// A later segment starts where the last one had it, and knows no more than what was given.
void SlidingWindow::AddReadout(Prior* prior) const {
  const double weight = 1 / calibration_prior_.options().readout_sigma_s;
  prior->blocks.push_back(model_.readout.get());
  prior->kinds.push_back(kReadoutKind);
  prior->x_lin.push_back({*model_.readout});
  const Eigen::Index rows = prior->jacobian.rows(), columns = prior->jacobian.cols();
  prior->jacobian.conservativeResizeLike(Eigen::MatrixXd::Zero(rows + 1, columns + 1));
  prior->jacobian(rows, columns) = weight;
  prior->residual.conservativeResize(rows + 1);
  prior->residual[rows] = weight * *model_.readout;
}

void SlidingWindow::Predict(FrameState* frame) const {
  const FrameState& last = newest();
  const Preintegration& imu = *frame->from_previous;
  const auto motion = imu.CorrectedFor(last.gyro_bias(), last.accel_bias(),
                                       GetErrors(model_.calibration->imu.data()));
  const double t = imu.duration_s();
  const Vector3d gravity(0, 0, -kGravity_m_s2);
  const double* calibration = model_.calibration->imu.data();
  const RigidTransform T =
      ImuAtCut(last.T_world_imu(), last.speed_bias.data(), calibration, last.cut);
  frame->speed_bias = last.speed_bias;
  const Vector3d velocity = last.velocity() + gravity * t + T.rotation * motion.velocity_m_s;
  std::copy_n(velocity.data(), 3, frame->speed_bias.begin());
  const RigidTransform at_cut(
      (T.rotation * motion.rotation).normalized(),
      T.translation + last.velocity() * t + 0.5 * gravity * t * t + T.rotation * motion.position_m);
  PoseToBlock(BodyAtExposure(at_cut, frame->speed_bias.data(), calibration, frame->cut),
              frame->pose.data());
}

void SlidingWindow::BringToStamp(FrameState* frame) const {
  slcmap::BringToStamp(state_, model_, frame);
}

std::unordered_set<int64_t> SlidingWindow::Track(FrameState* frame, FrameFit* fit) const {
  BringToStamp(frame);
  std::vector<Term> terms;
  AddImuTerm(state_.frames.back().get(), frame, model_, &terms);
  if (frame->stands_still) AddZeroVelocityTerm(frame, model_, &terms);
  // Terms bind what could be moved: copies of the landmarks, though they are held constant.
  std::deque<PointLandmark> landmarks;
  for (const PointLandmark* landmark : KnownLandmarks(*frame, state_)) {
    AddPointTerm(&landmarks.emplace_back(*landmark), frame, model_, &terms);
  }
  const auto is_constant = [&](const double* block) {
    return block != frame->pose.data() && block != frame->speed_bias.data();
  };
  SolverOptions solver;
  solver.max_iterations = kMaxTrackingIterations;
  Solve(&terms, Prior(), is_constant, solver);
  std::unordered_set<int64_t> outliers = RejectMisfits(frame);
  if (fit) {
    *fit = {MeasureImuFit(model_, newest(), *frame), static_cast<int>(landmarks.size()),
            static_cast<int>(outliers.size())};
  }
  return outliers;
}

std::unordered_set<int64_t> SlidingWindow::RejectMisfits(FrameState* frame) const {
  std::unordered_set<int64_t> outliers;
  for (const PointLandmark* landmark : KnownLandmarks(*frame, state_)) {
    const auto [left, right] = ObservationChi2(*landmark, *frame, model_);
    if (left > options_.max_tracking_chi2) {
      outliers.insert(landmark->id);
      frame->measurements.erase(landmark->id);
    } else if (right > options_.max_tracking_chi2) {
      frame->measurements.at(landmark->id).right.reset();
    }
  }
  return outliers;
}

FinishedIds SlidingWindow::AddKeyframe(std::unique_ptr<FrameState> frame) {
  state_.frames.push_back(std::move(frame));
  FrameState* newest = state_.frames.back().get();
  RegisterPoints(newest, &state_);
  BringToStamp(newest);
  TriangulatePoints(options_.triangulation, model_.Corrected(model_.geometry), &state_);
  RegisterLines(newest, &state_);
  structure_.Update(model_, newest, &state_);
  // Not before: until then what is known has the ties of the last optimisation in it.
  if (known_calibration_) calibration_ties_.Update(*known_calibration_);
  known_calibration_.reset();
  model_.calibration_ties = calibration_ties_.weights();
  iterations_ += Optimize(options_.max_iterations).iterations;
  fit_ = MeasureWindowFit(model_, state_);
  FinishedIds finished = RejectOutliers();
  while (static_cast<int>(state_.frames.size()) > options_.max_keyframes) {
    MarginalizeOldest(&finished);
  }
  return finished;
}

std::unordered_set<int64_t> SlidingWindow::ExtendStandstill(const std::vector<ImuSample>& samples,
                                                            int64_t stamp_ns, const ImuCut& cut) {
  FrameState& frame = *state_.frames.back();
  if (!frame.rests_since_ns) frame.rests_since_ns = frame.cut_stamp_ns();
  frame.stamp_ns = stamp_ns;
  frame.cut = cut;
  frame.stands_still = true;
  if (frame.from_previous) {
    for (size_t i = 1; i < samples.size(); ++i) frame.from_previous->Append(samples[i]);
    const int64_t keep_from_ns = frame.cut_stamp_ns() - kRestKept_ns;
    if (keep_from_ns - *frame.rests_since_ns > kRestKept_ns) {
      frame.from_previous->CutRest(*frame.rests_since_ns, keep_from_ns);
      frame.rests_since_ns = keep_from_ns;
    }
  }
  Optimize(options_.max_iterations);
  return RejectPoints();
}

void SlidingWindow::RepropagateMoved() {
  const ImuErrors errors = GetErrors(model_.calibration->imu.data());
  for (size_t i = 1; i < state_.frames.size(); ++i) {
    const FrameState& from = *state_.frames[i - 1];
    Preintegration& imu = *state_.frames[i]->from_previous;
    if ((from.gyro_bias() - imu.gyro_bias_rad_s()).norm() > kGyroBiasMoved_rad_s ||
        (from.accel_bias() - imu.accel_bias_m_s2()).norm() > kAccelBiasMoved_m_s2 ||
        (errors - imu.errors()).norm() > kErrorsMoved) {
      imu.Repropagate(from.gyro_bias(), from.accel_bias(), errors);
    }
  }
}

SolverSummary SlidingWindow::Optimize(int max_iterations) {
  RepropagateMoved();
  BringToStamps(model_, &state_);
  std::vector<Term> terms = BuildTerms(&state_, model_);
  SolverOptions solver;
  solver.max_iterations = max_iterations;
  const SolverSummary summary = Solve(&terms, state_.prior, NoneConstant, solver, &information_);
  last_solve_usable_ = summary.usable;
  BringToStamps(model_, &state_);
  return summary;
}

void SlidingWindow::ReleaseFromOldest(const WindowCovariance& covariance, PointLandmark* landmark,
                                      std::vector<Term>* terms,
                                      std::unordered_set<int64_t>* finished) {
  FrameState* oldest = state_.frames.front().get();
  const bool still_tracked = landmark->frames.back() == state_.frames.back().get();
  if (landmark->frames.size() == 1 || (landmark->triangulated && !still_tracked)) {
    // Nobody will see it again: what it tells of the other states goes into the prior.
    if (landmark->triangulated) {
      if (landmark->frames.size() > 1) {
        AddPointTerms(landmark, model_, terms);
        for (LineLandmark* line : CollectLines(*landmark, &state_)) {
          AddPointOnLineTerm(landmark, line, model_, terms);
        }
      }
      left_landmarks_.push_back(Describe(*landmark, model_, covariance));
    }
    finished->insert(landmark->id);
    return;
  }
  if (!landmark->triangulated) {
    std::erase(landmark->frames, oldest);
  } else if (!Rehost(model_.geometry, landmark)) {
    finished->insert(landmark->id);
    structure_.RemovePoints({landmark->id}, &state_);
  }
}

void SlidingWindow::MarginalizeOldest(FinishedIds* finished) {
  FrameState* oldest = state_.frames.front().get();
  const WindowCovariance covariance(information_);
  DescribeCalibration(0, covariance, &left_calibration_);  // Collect() knows the segment
  known_calibration_ = CalibrationKnown(covariance);
  std::vector<Term> terms;
  std::vector<double*> dropped{oldest->pose.data(), oldest->speed_bias.data()};
  std::unordered_set<int64_t> finished_points;
  AddImuTerm(oldest, state_.frames[1].get(), model_, &terms);
  if (oldest->stands_still) AddZeroVelocityTerm(oldest, model_, &terms);
  for (auto& [id, landmark] : state_.landmarks) {
    if (landmark.host() != oldest) continue;
    ReleaseFromOldest(covariance, &landmark, &terms, &finished_points);
  }
  left_keyframes_.push_back(DescribeFrame(*oldest));
  const auto gone = structure_.ReleaseOldest(model_, covariance, &state_, &terms, &dropped);
  SetPrior(Marginalize(terms, state_.prior, dropped));
  for (const int64_t id : finished_points) state_.landmarks.erase(id);
  for (const int64_t id : gone) state_.lines.erase(id);
  RemoveShared(&state_);
  finished->points.insert(finished_points.begin(), finished_points.end());
  finished->lines.insert(gone.begin(), gone.end());
  state_.frames.pop_front();
  state_.frames.front()->from_previous.reset();
}

void SlidingWindow::SetPrior(Prior prior) {
  state_.prior = std::move(prior);
  for (size_t k = 0; k < state_.prior.blocks.size(); ++k) {
    const std::vector<double>& x = state_.prior.x_lin[k];
    const auto adopt = [&](const auto& block, auto* linearization) {
      if (state_.prior.blocks[k] != block.data()) return;
      std::copy(x.begin(), x.end(), linearization->emplace().begin());
    };
    for (auto& frame : state_.frames) {
      adopt(frame->pose, &frame->pose_linearization);
      adopt(frame->speed_bias, &frame->speed_bias_linearization);
    }
    for (HeadingState& heading : state_.headings) {
      adopt(heading.heading_rad, &heading.linearization);
    }
    for (SlopeState& slope : state_.slopes) adopt(slope.angles_rad, &slope.linearization);
    for (auto& [id, line] : state_.lines) adopt(line.block, &line.linearization);
  }
}

std::optional<CalibrationBelief> SlidingWindow::CalibrationKnown(
    const WindowCovariance& covariance) const {
  const CalibrationState& state = calibration();
  if (!covariance.Knows(state.imu.data()) || !covariance.Knows(state.cameras.data())) return {};
  return CalibrationBelief{AsVector(state),
                           covariance.Of({state.imu.data(), state.cameras.data()})};
}

void SlidingWindow::DescribeCalibration(int segment, const WindowCovariance& covariance,
                                        std::vector<CalibrationEstimate>* out) const {
  const auto with_ties = CalibrationKnown(covariance);
  if (!with_ties) return;
  if (!out->empty() && out->back().stamp_ns == newest().stamp_ns) out->pop_back();
  out->push_back(Describe(calibration(), calibration_ties_.Without(*with_ties).covariance,
                          calibration_ties_.sigma_scale()));
  out->back().stamp_ns = newest().stamp_ns;
  out->back().segment = segment;
}

Keyframe SlidingWindow::DescribeFrame(const FrameState& frame) const {
  Keyframe out;
  out.id = frame.id;
  out.stamp_ns = frame.stamp_ns;
  out.T_world_imu = frame.T_world_imu();
  const Camera& camera = rig_.cameras[0];
  out.observations.reserve(frame.measurements.size());  // most of what a long run keeps
  for (const auto& [id, measurement] : frame.measurements) {
    KeyframeObservation observation;
    observation.landmark_id = id;
    observation.left_px = PixelFromPlane(camera, measurement.left);
    if (measurement.right) observation.right_px = PixelFromPlane(camera, *measurement.right);
    observation.camera = measurement.camera;
    out.observations.push_back(observation);
  }
  out.lines = LinesInPixels(frame, camera);
  return out;
}

void SlidingWindow::Collect(int segment, OdometryRun* run) {
  for (Keyframe& keyframe : left_keyframes_) {
    keyframe.segment = segment;
    run->keyframes.push_back(std::move(keyframe));
  }
  for (Landmark& landmark : left_landmarks_) {
    landmark.segment = segment;
    run->landmarks.push_back(landmark);
  }
  for (CalibrationEstimate& estimate : left_calibration_) {
    estimate.segment = segment;
    run->calibration.push_back(estimate);
  }
  left_calibration_.clear();
  left_keyframes_.clear();
  left_landmarks_.clear();
  structure_.Collect(segment, run);
}

void SlidingWindow::AddContents(int segment, OdometryRun* run) const {
  const WindowCovariance covariance(information_);
  if (!empty()) DescribeCalibration(segment, covariance, &run->calibration);
  for (const auto& frame : state_.frames) {
    run->keyframes.push_back(DescribeFrame(*frame));
    run->keyframes.back().segment = segment;
  }
  for (const auto& [id, landmark] : state_.landmarks) {
    if (!landmark.triangulated) continue;
    run->landmarks.push_back(Describe(landmark, model_, covariance));
    run->landmarks.back().segment = segment;
  }
  structure_.AddContents(segment, state_, covariance, run);
}

void SlidingWindow::Clear() {
  state_ = WindowState();
  information_ = StateInformation();
  known_calibration_.reset();
  structure_.Reset();
  calibration_prior_.Reset(model_.calibration.get());
  calibration_ties_ = NominalPrior(calibration_prior_.options(), calibration_prior_.belief());
  model_.calibration_ties = calibration_ties_.weights();
}

void SlidingWindow::ResetCalibration(const CalibrationPrior& prior) {
  calibration_prior_ = prior;
  Clear();
}

void SlidingWindow::LearnCalibration() {
  const auto with_ties = CalibrationKnown(WindowCovariance(information_));
  if (with_ties) calibration_prior_.Learn(calibration_ties_.Without(*with_ties));
}

std::string SlidingWindow::CalibrationBeyondLimit() const {
  return calibration_prior_.BeyondLimit(calibration());
}

void SlidingWindow::HoldCalibration() { calibration_prior_.Hold(calibration()); }

bool SlidingWindow::CanCutAgain(size_t frame, const ImuBuffer& imu, int64_t offset_ns) const {
  if (frame == 0) return false;
  const FrameState &before = *state_.frames[frame - 1], &at = *state_.frames[frame];
  const auto later = state_.frames.begin() + static_cast<std::ptrdiff_t>(frame);
  // Of a rest only the newest part is there.
  if (std::any_of(later, std::min(later + 2, state_.frames.end()),
                  [](const auto& f) { return f->rests_since_ns.has_value(); })) {
    return false;
  }
  return before.cut_stamp_ns() >= imu.first_stamp_ns() && imu.Covers(at.stamp_ns + offset_ns) &&
         at.stamp_ns + offset_ns > before.cut_stamp_ns();
}

void SlidingWindow::CutAgain(const ImuBuffer& imu, int64_t offset_ns) {
  bool moved = false;  // where the interval starts
  for (size_t i = 1; i < state_.frames.size(); ++i) {
    FrameState& frame = *state_.frames[i];
    const bool moves = frame.cut.offset_ns != offset_ns && CanCutAgain(i, imu, offset_ns);
    if (moves) frame.cut = MakeCut(imu, frame.stamp_ns, offset_ns);
    if (moves || moved) {
      frame.from_previous->Replace(
          imu.Between(state_.frames[i - 1]->cut_stamp_ns(), frame.cut_stamp_ns()));
    }
    moved = moves;
  }
}

}  // namespace slcmap::odometry
