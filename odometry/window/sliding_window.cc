#include "odometry/window/sliding_window.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Biases further than this from where an interval was integrated make its correction inexact.
constexpr double kGyroBiasMoved_rad_s = 0.005;
constexpr double kAccelBiasMoved_m_s2 = 0.1;

bool NoneConstant(const double*) { return false; }

// Squared whitened residuals of one sight, left and right apart (right 0 where it was not seen).
std::pair<double, double> SightChi2(PointLandmark* landmark, FrameState* frame,
                                    const CostModel& model) {
  std::vector<Term> terms;
  AddPointTerm(landmark, frame, model, &terms);
  if (terms.empty()) return {0, 0};
  Eigen::Vector4d r = Eigen::Vector4d::Zero();
  terms[0].factor->Evaluate(terms[0].blocks.data(), r.data(), nullptr);
  return {r.head<2>().squaredNorm(), r.tail<2>().squaredNorm()};
}

}  // namespace

SlidingWindow::SlidingWindow(const WindowOptions& options, const Rig& rectified_rig)
    : options_(options), rig_(rectified_rig) {
  model_.geometry =
      StereoGeometry(rig_.T_imu_camera, rig_.cameras[0].fx_px / options.point_sigma_px);
  model_.point_loss = std::make_unique<ceres::HuberLoss>(options.point_loss_sigma);
  model_.zero_velocity_sigma_m_s = options.zero_velocity_sigma_m_s;
}

void SlidingWindow::Start(std::vector<std::unique_ptr<FrameState>> frames) {
  state_ = WindowState();
  for (auto& frame : frames) {
    state_.frames.push_back(std::move(frame));
    RegisterMeasurements(state_.frames.back().get());
  }
  SetFirstPrior();
  TriangulateLandmarks();
  Optimize(5 * options_.max_iterations);
  TriangulateLandmarks();
  Optimize(5 * options_.max_iterations);
  RejectOutliers();
}

void SlidingWindow::SetFirstPrior() {
  // Position and heading are free to choose: their deviations only have to be small against what
  // matters, and large enough to keep the system well conditioned.
  constexpr double kGaugeSigma_m = 1e-3, kGaugeSigma_rad = 1e-4;
  FrameState& first = *state_.frames.front();
  Prior prior;
  prior.blocks = {first.pose.data(), first.speed_bias.data()};
  prior.block_sizes = {kPoseSize, kSpeedBiasSize};
  prior.x_lin = {{first.pose.begin(), first.pose.end()},
                 {first.speed_bias.begin(), first.speed_bias.end()}};
  Vector3d rotation_weight = Vector3d::Constant(1.0 / options_.first_tilt_sigma_rad);
  rotation_weight.z() = 1.0 / kGaugeSigma_rad;
  prior.jacobian = Eigen::MatrixXd::Zero(15, 15);
  prior.jacobian.diagonal().head<3>().setConstant(1.0 / kGaugeSigma_m);
  // Tilt and heading are turns about world axes: R delta.
  prior.jacobian.block<3, 3>(3, 3) =
      rotation_weight.asDiagonal() * first.T_world_imu().rotation.toRotationMatrix();
  prior.jacobian.diagonal().segment<3>(6).setConstant(1.0 / options_.first_velocity_sigma_m_s);
  prior.jacobian.diagonal().segment<3>(9).setConstant(1.0 / options_.first_gyro_bias_sigma_rad_s);
  prior.jacobian.diagonal().segment<3>(12).setConstant(1.0 / options_.first_accel_bias_sigma_m_s2);
  prior.residual = Eigen::VectorXd::Zero(15);
  state_.prior = std::move(prior);
}

void SlidingWindow::Predict(FrameState* frame) const {
  const FrameState& last = newest();
  const Preintegration& imu = *frame->from_previous;
  const auto motion = imu.CorrectedFor(last.gyro_bias(), last.accel_bias());
  const double t = imu.duration_s();
  const Vector3d gravity(0, 0, -kGravity_m_s2);
  const RigidTransform T = last.T_world_imu();
  frame->speed_bias = last.speed_bias;
  const Vector3d velocity = last.velocity() + gravity * t + T.rotation * motion.velocity_m_s;
  std::copy_n(velocity.data(), 3, frame->speed_bias.begin());
  PoseToBlock({(T.rotation * motion.rotation).normalized(), T.translation + last.velocity() * t +
                                                                0.5 * gravity * t * t +
                                                                T.rotation * motion.position_m},
              frame->pose.data());
}

std::unordered_set<int64_t> SlidingWindow::Track(FrameState* frame) const {
  // The landmarks and the newest keyframe are bound to the terms, but held constant.
  auto& window = const_cast<WindowState&>(state_);
  std::vector<Term> terms;
  AddImuTerm(window.frames.back().get(), frame, &terms);
  if (frame->stands_still) AddZeroVelocityTerm(frame, model_, &terms);
  std::vector<PointLandmark*> seen;
  for (const auto& [id, measurement] : frame->measurements) {
    const auto it = window.landmarks.find(id);
    if (it == window.landmarks.end() || !it->second.triangulated) continue;
    seen.push_back(&it->second);
    AddPointTerm(&it->second, frame, model_, &terms);
  }
  const auto is_constant = [&](const double* block) {
    return block != frame->pose.data() && block != frame->speed_bias.data();
  };
  SolverOptions solver;
  solver.max_iterations = options_.max_tracking_iterations;
  Solve(&terms, Prior(), is_constant, solver);

  std::unordered_set<int64_t> outliers;
  for (PointLandmark* landmark : seen) {
    const auto [left, right] = SightChi2(landmark, frame, model_);
    if (left > options_.max_tracking_chi2) {
      outliers.insert(landmark->id);
      frame->measurements.erase(landmark->id);
    } else if (right > options_.max_tracking_chi2) {
      frame->measurements.at(landmark->id).right.reset();
    }
  }
  return outliers;
}

std::unordered_set<int64_t> SlidingWindow::AddKeyframe(std::unique_ptr<FrameState> frame) {
  state_.frames.push_back(std::move(frame));
  RegisterMeasurements(state_.frames.back().get());
  TriangulateLandmarks();
  Optimize(options_.max_iterations);
  std::unordered_set<int64_t> outliers = RejectOutliers();
  while (static_cast<int>(state_.frames.size()) > options_.max_keyframes) {
    for (const int64_t id : MarginalizeOldest()) outliers.insert(id);
  }
  return outliers;
}

void SlidingWindow::ExtendStandstill(const std::vector<ImuSample>& samples) {
  FrameState& frame = *state_.frames.back();
  frame.stamp_ns = samples.back().stamp_ns;
  frame.stands_still = true;
  if (frame.from_previous) {
    for (size_t i = 1; i < samples.size(); ++i) frame.from_previous->Append(samples[i]);
  }
  Optimize(options_.max_iterations);
}

void SlidingWindow::RegisterMeasurements(FrameState* frame) {
  for (const auto& [id, measurement] : frame->measurements) {
    PointLandmark& landmark = state_.landmarks[id];
    landmark.id = id;
    landmark.frames.push_back(frame);
  }
}

void SlidingWindow::TriangulateLandmarks() {
  for (auto& [id, landmark] : state_.landmarks) {
    if (landmark.triangulated) continue;
    const auto inverse_depth = TriangulateInverseDepth(landmark, model_.geometry, {});
    landmark.triangulated = inverse_depth.has_value();
    if (!inverse_depth) continue;
    const Vector2d& left = landmark.host()->measurements.at(id).left;
    landmark.point = {left.x(), left.y(), *inverse_depth};
  }
}

void SlidingWindow::RepropagateMovedBiases() {
  for (size_t i = 1; i < state_.frames.size(); ++i) {
    const FrameState& from = *state_.frames[i - 1];
    Preintegration& imu = *state_.frames[i]->from_previous;
    if ((from.gyro_bias() - imu.gyro_bias_rad_s()).norm() > kGyroBiasMoved_rad_s ||
        (from.accel_bias() - imu.accel_bias_m_s2()).norm() > kAccelBiasMoved_m_s2) {
      imu.Repropagate(from.gyro_bias(), from.accel_bias());
    }
  }
}

void SlidingWindow::Optimize(int max_iterations) {
  RepropagateMovedBiases();
  std::vector<Term> terms = BuildTerms(&state_, model_);
  SolverOptions solver;
  solver.max_iterations = max_iterations;
  last_solve_usable_ = Solve(&terms, state_.prior, NoneConstant, solver).usable;
}

std::unordered_set<int64_t> SlidingWindow::RejectOutliers() {
  std::unordered_set<int64_t> outliers;
  const double limit = options_.max_point_chi2;
  for (auto it = state_.landmarks.begin(); it != state_.landmarks.end();) {
    PointLandmark& landmark = it->second;
    int bad = 0, all = 0;
    const std::vector<FrameState*> frames = landmark.frames;
    for (FrameState* frame : frames) {
      if (!landmark.triangulated) break;
      const auto [left, right] = SightChi2(&landmark, frame, model_);
      ++all;
      if (right > limit) frame->measurements.at(landmark.id).right.reset();
      if (left <= limit) continue;
      ++bad;
      // The point is expressed in its host: without the host's sight it is not worth keeping.
      if (frame == landmark.host()) bad = 2 * static_cast<int>(frames.size());
      if (frame != landmark.host()) RemoveMeasurement(&landmark, frame);
    }
    const bool outlier =
        2 * bad > all || (landmark.triangulated && landmark.inverse_depth_per_m() <= 0);
    if (outlier) {
      outliers.insert(landmark.id);
      for (FrameState* frame : landmark.frames) frame->measurements.erase(landmark.id);
      it = state_.landmarks.erase(it);
    } else {
      ++it;
    }
  }
  return outliers;
}

void SlidingWindow::RemoveMeasurement(PointLandmark* landmark, FrameState* frame) {
  std::erase(landmark->frames, frame);
  frame->measurements.erase(landmark->id);
}

bool SlidingWindow::Rehost(PointLandmark* landmark) const {
  const Vector3d p_world = LandmarkInWorld(*landmark, model_.geometry);
  landmark->frames.erase(landmark->frames.begin());
  const RigidTransform T_world_camera =
      landmark->host()->T_world_imu() * model_.geometry.T_imu_camera[0];
  const Vector3d p_camera = T_world_camera.Inverse() * p_world;
  if (p_camera.z() < 0.05) return false;
  landmark->point = {p_camera.x() / p_camera.z(), p_camera.y() / p_camera.z(), 1.0 / p_camera.z()};
  ++landmark->released_frames;
  return true;
}

void SlidingWindow::ReleaseFromOldest(PointLandmark* landmark, std::vector<Term>* terms,
                                      std::vector<int64_t>* finished) {
  FrameState* oldest = state_.frames.front().get();
  const bool still_tracked = landmark->frames.back() == state_.frames.back().get();
  if (landmark->frames.size() == 1 || (landmark->triangulated && !still_tracked)) {
    // Nobody will see it again: what it tells of the other states goes into the prior.
    if (landmark->triangulated) {
      if (landmark->frames.size() > 1) AddPointTerms(landmark, model_, terms);
      left_landmarks_.push_back(Describe(*landmark));
    }
    finished->push_back(landmark->id);
    return;
  }
  if (!landmark->triangulated) {
    std::erase(landmark->frames, oldest);
  } else if (!Rehost(landmark)) {
    finished->push_back(landmark->id);
  }
}

std::vector<int64_t> SlidingWindow::MarginalizeOldest() {
  FrameState* oldest = state_.frames.front().get();
  std::vector<Term> terms;
  std::vector<int64_t> finished;
  AddImuTerm(oldest, state_.frames[1].get(), &terms);
  if (oldest->stands_still) AddZeroVelocityTerm(oldest, model_, &terms);
  for (auto& [id, landmark] : state_.landmarks) {
    if (landmark.host() == oldest) ReleaseFromOldest(&landmark, &terms, &finished);
  }
  AdoptPrior(Marginalize(terms, state_.prior, {oldest->pose.data(), oldest->speed_bias.data()}));
  left_keyframes_.push_back(Describe(*oldest));
  for (const int64_t id : finished) state_.landmarks.erase(id);
  state_.frames.pop_front();
  state_.frames.front()->from_previous.reset();
  return finished;
}

void SlidingWindow::AdoptPrior(Prior prior) {
  state_.prior = std::move(prior);
  for (size_t k = 0; k < state_.prior.blocks.size(); ++k) {
    const std::vector<double>& x = state_.prior.x_lin[k];
    for (auto& frame : state_.frames) {
      if (state_.prior.blocks[k] == frame->pose.data()) {
        frame->pose_linearization.emplace();
        std::copy(x.begin(), x.end(), frame->pose_linearization->begin());
      } else if (state_.prior.blocks[k] == frame->speed_bias.data()) {
        frame->speed_bias_linearization.emplace();
        std::copy(x.begin(), x.end(), frame->speed_bias_linearization->begin());
      }
    }
  }
}

Matrix15d SlidingWindow::NewestCovariance() {
  std::vector<double*> dropped;
  for (const auto& frame : state_.frames) {
    if (frame == state_.frames.back()) continue;
    dropped.push_back(frame->pose.data());
    dropped.push_back(frame->speed_bias.data());
  }
  const Prior newest = Marginalize(BuildTerms(&state_, model_), state_.prior, dropped);
  // With a single frame the blocks may come in either order; they come as the prior has them.
  const Eigen::MatrixXd inverse =
      newest.jacobian.triangularView<Eigen::Upper>().solve(Eigen::MatrixXd::Identity(15, 15));
  return inverse * inverse.transpose();
}

double SlidingWindow::ReprojectionRms() {
  double sum = 0;
  int rows = 0;
  for (auto& [id, landmark] : state_.landmarks) {
    if (!landmark.triangulated) continue;
    std::vector<Term> terms;
    AddPointTerms(&landmark, model_, &terms);
    for (const Term& term : terms) {
      Eigen::Vector4d r = Eigen::Vector4d::Zero();
      term.factor->Evaluate(term.blocks.data(), r.data(), nullptr);
      sum += r.squaredNorm();
      rows += term.factor->rows();
    }
  }
  return rows > 0 ? std::sqrt(sum / rows) : 0;
}

int SlidingWindow::TriangulatedCount() const {
  return static_cast<int>(std::count_if(state_.landmarks.begin(), state_.landmarks.end(),
                                        [](const auto& l) { return l.second.triangulated; }));
}

Landmark SlidingWindow::Describe(const PointLandmark& described) const {
  PointLandmark copy = described;
  PointLandmark* landmark = &copy;
  // The information on the point with the poses as they are; d depth = d lambda / lambda^2.
  std::vector<Term> terms;
  AddPointTerms(landmark, model_, &terms);
  Eigen::Matrix3d information = 1e-9 * Eigen::Matrix3d::Identity();
  for (const Term& term : terms) {
    Eigen::Vector4d r;
    Eigen::Matrix<double, 4, 3, Eigen::RowMajor> j = Eigen::Matrix<double, 4, 3>::Zero();
    std::array<double*, Factor::kMaxBlocks> jacobians{};
    jacobians[term.factor->blocks() - 1] = j.data();
    term.factor->Linearize(term.blocks.data(), r.data(), jacobians.data());
    information += j.transpose() * j;
  }
  Landmark out;
  out.id = landmark->id;
  out.p_world = LandmarkInWorld(*landmark, model_.geometry);
  const double lambda = landmark->inverse_depth_per_m();
  out.sigma_m = std::sqrt(information.inverse()(2, 2)) / (lambda * lambda);
  out.observations = static_cast<int>(landmark->frames.size()) + landmark->released_frames;
  return out;
}

Keyframe SlidingWindow::Describe(const FrameState& frame) const {
  Keyframe out;
  out.id = frame.id;
  out.stamp_ns = frame.stamp_ns;
  out.T_world_imu = frame.T_world_imu();
  const Camera& camera = rig_.cameras[0];
  const auto pixel = [&](const Vector2d& on_plane) {
    return Vector2d(camera.fx_px * on_plane.x() + camera.cx_px,
                    camera.fy_px * on_plane.y() + camera.cy_px);
  };
  for (const auto& [id, measurement] : frame.measurements) {
    KeyframeObservation observation;
    observation.landmark_id = id;
    observation.left_px = pixel(measurement.left);
    if (measurement.right) observation.right_px = pixel(*measurement.right);
    out.observations.push_back(observation);
  }
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
  left_keyframes_.clear();
  left_landmarks_.clear();
}

void SlidingWindow::AddContents(int segment, OdometryRun* run) const {
  for (const auto& frame : state_.frames) {
    run->keyframes.push_back(Describe(*frame));
    run->keyframes.back().segment = segment;
  }
  for (const auto& [id, landmark] : state_.landmarks) {
    if (!landmark.triangulated) continue;
    run->landmarks.push_back(Describe(landmark));
    run->landmarks.back().segment = segment;
  }
}

}  // namespace slcmap
