#include "odometry/window/estimator.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "odometry/geometry/imu.h"
#include "odometry/geometry/pinhole.h"
#include "odometry/run/run_queries.h"
#include "odometry/window/window_state.h"

namespace slcmap::inline odometry {

using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

// Where a keyframe has fewer points than this share of PointTrackerOptions::max_points, they are
// averaged over more keyframes: at least one in kSparseInterval_s.
constexpr double kSparseShare = 0.7;
constexpr double kSparseInterval_s = 0.25;
constexpr double kStillParallax_px = 1.0;     // with the rotation: below it the rig does not move
constexpr double kMaxStillRate_rad_s = 0.05;  // mean, without bias: above it the rig turns
constexpr double kMaxImuGap_s = 0.3;          // a longer one starts a new segment

constexpr double kReportEvery_s = 2.0;  // failed attempts at initialisation are reported this often
constexpr double kStandstillStep_s = 1.0;  // how often the window hears that the rig stands still
constexpr double kRestLooksBack_s = 0.5;   // at most, to tell whether the rig rests
constexpr double kMaxRestSpeed_m_s = 0.05;
// Of the limit for gaps in the images: how long the IMU alone, with what lines there are, carries a
// pose on where the images show bare walls.
constexpr double kBareWalls = 3;
constexpr double kMinForce_m_s2 = 1.0;  // less has no direction to speak of

// A camera at a frame from the same at an earlier one.
Quaterniond CameraRotation(const FrameState& now, const FrameState& last, const Rig& rig,
                           int camera = 0) {
  const Quaterniond& R_imu_camera = rig.T_imu_camera[camera].rotation;
  return R_imu_camera.conjugate() * now.T_world_imu().rotation.conjugate() *
         last.T_world_imu().rotation * R_imu_camera;
}

}  // namespace

Estimator::Estimator(const EstimatorOptions& options, const Rig& rectified_rig, PointSource* source,
                     LineSource* lines, int threads)
    : options_(options),
      rig_(rectified_rig),
      policy_(threads > 1 ? std::launch::async : std::launch::deferred),
      source_(source),
      lines_(lines),
      initializer_(options.initializer, rectified_rig),
      window_(options, rectified_rig) {
  SetLensShifts(std::vector<LensShift>(rig_.cameras.size()));
}

void Estimator::SetLensShifts(const std::vector<LensShift>& shifts) {
  window_.SetLensShifts(shifts);
  rectifications_.clear();
  for (size_t i = 0; i < shifts.size(); ++i) {
    rectifications_.emplace_back(rig_.cameras[i], shifts[i]);
  }
}

Quaterniond Estimator::RightTurnSince(int64_t stamp_ns) const {
  const FeltMotion felt = FeltAround(imu_, stamp_ns, row_times_.reach_s());
  const Eigen::Matrix3d gyro = MakeCorrection(tracking_.errors).gyro;
  BodyMotion motion;
  motion.rate_rad_s = tracking_.R_body_imu * (gyro * felt.rate_rad_s - gyro_bias_rad_s_);
  motion.rate_change_rad_s2 = tracking_.R_body_imu * (gyro * felt.rate_change_rad_s2);
  const Quaterniond& R_imu_right = rig_.T_imu_camera[1].rotation;
  return R_imu_right.conjugate() * motion.At(row_times_.right_offset_s()).rotation * R_imu_right;
}

RightCorrection Estimator::KnownRight() const {
  const double* cameras = window_.calibration().cameras.data();
  return {Eigen::Map<const Vector3d>(cameras + kRowRightRotation), GetLens(1, cameras).centre_px};
}

std::optional<OnlineState> Estimator::AddImage(int64_t stamp_ns) {
  CutAgain(stamp_ns);
  std::optional<OnlineState> state = window_.empty() ? Initialize(stamp_ns) : Estimate(stamp_ns);
  last_stamp_ns_ = stamp_ns;
  imu_.DropBefore(OldestSampleNeeded(stamp_ns));
  return state;
}

// The samples at the exposure, as its time is estimated, but none after the image's stamp: these
// may not have arrived yet, and whether they have must not matter.
ImuCut Estimator::NewCut(int64_t stamp_ns) const {
  int64_t cut_ns = stamp_ns + std::min<int64_t>(cut_offset_ns_, 0);
  const bool integrates = !window_.empty() || initializer_.size() > 0;  // from the cut before
  if (integrates) cut_ns = std::max(cut_ns, last_cut_ns_ + 1);
  return MakeCut(imu_, stamp_ns, cut_ns - stamp_ns);
}

// Follows the estimated time offset: at cuts far from the exposure a straight motion and a constant
// turn in between would not do. The newest keyframe's stays well before the image that comes now.
// Never while images since the last keyframe are integrated.
void Estimator::CutAgain(int64_t stamp_ns) {
  constexpr int64_t kMoved_ns = 300'000, kMaxStep_ns = 10'000'000;
  if (window_.empty() || since_keyframe_) return;
  const int64_t offset_ns = std::min(ToNanoseconds(window_.calibration().imu[kRowTimeOffset]),
                                     (stamp_ns - *last_stamp_ns_) / 2);
  if (std::abs(offset_ns - window_.newest().cut.offset_ns) < kMoved_ns) return;
  cut_offset_ns_ += std::clamp(offset_ns - cut_offset_ns_, -kMaxStep_ns, kMaxStep_ns);
  window_.CutAgain(imu_, cut_offset_ns_);
  last_cut_ns_ = window_.newest().cut_stamp_ns();
}

// To cut again what is in the window; of long rests that is not wanted.
int64_t Estimator::OldestSampleNeeded(int64_t stamp_ns) const {
  constexpr int64_t kMargin_ns = 100'000'000, kLongest_ns = 20'000'000'000;
  if (keyframe_) return stamp_ns - kLongest_ns;  // the window belongs to another thread
  int64_t oldest_ns = stamp_ns;
  if (!window_.empty()) {
    oldest_ns = window_.state().frames.front()->cut_stamp_ns();
  } else if (initializer_.size() > 0) {
    oldest_ns = initializer_.first_cut_ns();
  }
  return std::max(std::min(oldest_ns, stamp_ns) - kMargin_ns, stamp_ns - kLongest_ns);
}

std::optional<OnlineState> Estimator::CheckGaps(int64_t stamp_ns) {
  const std::string gap = FindGap(stamp_ns);
  if (gap.empty()) return std::nullopt;
  const std::optional<OnlineState> state = FinishKeyframe();
  Restart(gap, true);
  return state;
}

std::string Estimator::FindGap(int64_t stamp_ns) const {
  if (!last_stamp_ns_) return {};
  if (imu_.LongestGap(*last_stamp_ns_, stamp_ns) > kMaxImuGap_s) {
    return "a gap in the IMU samples, or a clock set to another time";
  }
  if (ToSeconds(stamp_ns - *last_stamp_ns_) > options_.failure.max_lost_s) {
    return "a gap in the images";
  }
  return {};
}

bool Estimator::RestsUntil(int64_t stamp_ns) const {
  if (!last_stamp_ns_) return true;
  const auto samples =
      imu_.Between(std::max(*last_stamp_ns_, stamp_ns - ToNanoseconds(kRestLooksBack_s)), stamp_ns);
  if (samples.empty()) return true;
  const ImuSpread gyro = ComputeSpread(samples, &ImuSample::angular_velocity_rad_s);
  const ImuSpread accel = ComputeSpread(samples, &ImuSample::specific_force_m_s2);
  if (gyro.sigma > kStartMaxStillGyroSigma_rad_s || accel.sigma > kStartMaxStillAccelSigma_m_s2) {
    return false;
  }
  // Before initialisation neither the gyroscope's bias nor the speed is known.
  return window_.empty() || (last_speed_m_s_ < kMaxRestSpeed_m_s &&
                             (gyro.mean - gyro_bias_rad_s_).norm() < kMaxStillRate_rad_s);
}

Quaterniond Estimator::PredictedCameraRotation(int64_t stamp_ns) const {
  if (!last_stamp_ns_) return Quaterniond::Identity();
  Preintegration imu(rig_.imu_noise, gyro_bias_rad_s_, Vector3d::Zero(), tracking_.errors);
  AppendImu(*last_stamp_ns_ + tracking_.offset_ns, stamp_ns + tracking_.offset_ns, &imu);
  const Quaterniond R_last_now = tracking_.R_body_imu *
                                 imu.CorrectedFor(gyro_bias_rad_s_, Vector3d::Zero()).rotation *
                                 tracking_.R_body_imu.conjugate();
  const Quaterniond& R_imu_camera = rig_.T_imu_camera[0].rotation;
  return R_imu_camera.conjugate() * R_last_now.conjugate() * R_imu_camera;
}

void Estimator::Describe(OdometryRun* run) const {
  run->keyframes = run_.keyframes;
  run->landmarks = run_.landmarks;
  run->manhattan_worlds = run_.manhattan_worlds;
  run->sloped_directions = run_.sloped_directions;
  run->calibration = run_.calibration;
  run->lines = run_.lines;
  run->line_merges = run_.line_merges;
  for (const auto& [kind, count] : run_.warnings) run->warnings[kind] += count;
  run->timings.window_iterations = window_.iterations();
  run->figures = figures_.Figures();
  window_.AddContents(segment_, run);
  ResolveMergedLines(run);
}

void Estimator::DescribeFinished(FinishedMarks* marks, OdometryRun* run) const {
  TakeNew(run_.keyframes, &marks->keyframes, &run->keyframes);
  TakeNew(run_.landmarks, &marks->landmarks, &run->landmarks);
  TakeNew(run_.lines, &marks->lines, &run->lines);
  TakeNew(run_.calibration, &marks->calibration, &run->calibration);
}

void Estimator::DescribeWindow(OdometryRun* run) const {
  run->manhattan_worlds = run_.manhattan_worlds;
  run->sloped_directions = run_.sloped_directions;
  run->line_merges = run_.line_merges;
  run->warnings = run_.warnings;
  run->figures = figures_.Figures();
  window_.AddContents(segment_, run);
}

std::unique_ptr<FrameState> Estimator::NewFrame(int64_t stamp_ns) {
  auto frame = std::make_unique<FrameState>();
  frame->id = next_frame_id_++;
  frame->stamp_ns = stamp_ns;
  frame->cut = NewCut(stamp_ns);
  if (!row_times_.at_once()) frame->felt = FeltAround(imu_, stamp_ns, row_times_.reach_s());
  TakeMeasurements(frame.get());
  return frame;
}

void Estimator::TakeMeasurements(FrameState* frame) const {
  for (const PointObservation& point : source_->observations()) {
    StereoMeasurement& measurement = frame->measurements[point.id];
    measurement.left = PlaneFromPixel(rig_.cameras[0], point.left_px);
    measurement.camera = point.camera;
    measurement.right.reset();
    if (point.right_px) {
      measurement.right = rectifications_[point.camera + 1].GivenPlane(*point.right_px);
    }
    measurement.timed = row_times_.Of(measurement.left, measurement.right, measurement.camera);
  }
}

void Estimator::AppendImu(int64_t from_ns, int64_t to_ns, Preintegration* imu) const {
  const auto samples = imu_.Between(from_ns, to_ns);
  // Neighbouring intervals share their end sample.
  const size_t first = imu->samples().empty() ? 0 : 1;
  for (size_t i = first; i < samples.size(); ++i) imu->Append(samples[i]);
}

// Upwards in the left camera, as far as the accelerometer alone tells: nothing where it falls or is
// silent.
std::vector<Vector3d> Estimator::RoughVertical(int64_t stamp_ns) const {
  if (!last_stamp_ns_) return {};
  const auto samples = imu_.Between(*last_stamp_ns_, stamp_ns);
  if (samples.empty()) return {};
  const Vector3d force_m_s2 = ComputeSpread(samples, &ImuSample::specific_force_m_s2).mean;
  if (force_m_s2.norm() < kMinForce_m_s2) return {};
  return {rig_.T_imu_camera[0].rotation.conjugate() * force_m_s2.normalized()};
}

std::optional<OnlineState> Estimator::Initialize(int64_t stamp_ns) {
  const auto timed = clock_.Time("initialisation");
  std::future<void> lines =
      StartLines(PredictedCameraRotation(stamp_ns), {}, RoughVertical(stamp_ns));
  source_->Detect();
  auto frame = NewFrame(stamp_ns);
  if (initializer_.size() > 0) {
    frame->from_previous =
        std::make_unique<Preintegration>(rig_.imu_noise, Vector3d::Zero(), Vector3d::Zero(),
                                         GetErrors(window_.calibration().imu.data()));
    AppendImu(last_cut_ns_, frame->cut_stamp_ns(), frame->from_previous.get());
  }
  last_cut_ns_ = frame->cut_stamp_ns();
  TakeLines(std::move(lines), frame.get());
  initializer_.AddFrame(std::move(frame));
  if (!initializer_.Ready()) return std::nullopt;
  const InitializationResult result = initializer_.Try(start_pose_, imu_, &window_);
  if (!result.success) {
    ++run_.warnings["attempts at initialisation that failed"];
    if (!last_report_ns_ || ToSeconds(stamp_ns - *last_report_ns_) >= kReportEvery_s) {
      spdlog::info("segment {} {}", segment_, result.report);
      last_report_ns_ = stamp_ns;
    }
    return std::nullopt;
  }
  spdlog::info("segment {} {}", segment_, result.report);
  source_->Remove(result.finished.points);
  if (lines_) lines_->Remove(result.finished.lines);
  last_cut_ns_ = window_.newest().cut_stamp_ns();
  cut_offset_ns_ = window_.newest().cut.offset_ns;
  gyro_bias_rad_s_ = window_.newest().gyro_bias();
  UpdateForTracking();
  last_speed_m_s_ = window_.newest().velocity().norm();
  lost_since_ns_.reset();
  return GetState(window_.newest());
}

std::optional<OnlineState> Estimator::Estimate(int64_t stamp_ns) {
  std::unique_ptr<FrameState> frame = NewFrame(stamp_ns);
  frame->from_previous = std::move(since_keyframe_);
  if (!frame->from_previous) {
    frame->from_previous = std::make_unique<Preintegration>(
        rig_.imu_noise, window_.newest().gyro_bias(), window_.newest().accel_bias(),
        GetErrors(window_.calibration().imu.data()));
  }
  AppendImu(last_cut_ns_, frame->cut_stamp_ns(), frame->from_previous.get());
  last_cut_ns_ = frame->cut_stamp_ns();
  frame->stands_still = StandsStill(*frame);
  if (ViewIsCarried(*frame)) {
    Restart("a view that moves with the rig, as a lift's cabin", true);
    return std::nullopt;
  }
  {
    const auto timed = clock_.Time("frame estimation");
    window_.Predict(frame.get());
    FrameFit fit;
    source_->Remove(window_.Track(frame.get(), &fit));
    figures_.AddImage(stamp_ns, fit);
  }
  const OnlineState state = GetState(*frame);
  gyro_bias_rad_s_ = state.gyro_bias_rad_s;
  UpdateForTracking();
  if (IsKeyframe(*frame) && FindImpossible(state, options_.failure).empty()) {
    StartKeyframe(std::move(frame));
    return policy_ == std::launch::async ? std::nullopt : FinishKeyframe();
  }
  since_keyframe_ = std::move(frame->from_previous);
  if (!followed_) Follow(*frame);
  if (frame->stands_still && window_.newest().stands_still &&
      since_keyframe_->duration_s() > kStandstillStep_s) {
    source_->Remove(
        window_.ExtendStandstill(since_keyframe_->samples(), frame->stamp_ns, frame->cut));
    since_keyframe_.reset();
  }
  return Judge(state, static_cast<int>(source_->observations().size()));
}

// The first image after a keyframe.
void Estimator::Follow(const FrameState& frame) {
  followed_.emplace();
  for (const auto& [id, measurement] : frame.measurements) followed_->insert(id);
}

void Estimator::StartKeyframe(std::unique_ptr<FrameState> frame) {
  followed_.reset();
  std::future<void> lines = StartLines(CameraRotation(*frame, window_.newest(), rig_),
                                       PredictLines(window_.state(), *frame, rig_),
                                       AxesInCamera(window_.state(), *frame, rig_));
  {
    const auto timed = clock_.Time("point detection");
    source_->Detect();
  }
  frame->measurements.clear();
  TakeMeasurements(frame.get());
  window_.BringToStamp(frame.get());
  source_->Remove(window_.RejectMisfits(frame.get()));
  TakeLines(std::move(lines), frame.get());
  StartedKeyframe started;
  for (const PointObservation& point : source_->observations()) {
    started.point_ids.push_back(point.id);
  }
  started.optimized = std::async(policy_, [this, frame = std::move(frame)]() mutable {
    const auto timed = clock_.Time("window optimisation");
    return window_.AddKeyframe(std::move(frame));
  });
  keyframe_ = std::move(started);  // last: the system may refuse a thread
}

std::optional<OnlineState> Estimator::FinishKeyframe() {
  if (!keyframe_) return std::nullopt;
  StartedKeyframe keyframe = std::move(*keyframe_);
  keyframe_.reset();
  const FinishedIds finished = keyframe.optimized.get();
  source_->Remove(finished.points);
  if (lines_) lines_->Remove(finished.lines);
  figures_.AddKeyframe(window_.newest().stamp_ns, window_.fit());
  window_.Collect(segment_, &run_);
  const auto visible = std::count_if(keyframe.point_ids.begin(), keyframe.point_ids.end(),
                                     [&](int64_t id) { return !finished.points.contains(id); });
  return Judge(GetState(window_.newest()), static_cast<int>(visible));
}

// The state, if it can be trusted; else the segment ends.
std::optional<OnlineState> Estimator::Judge(const OnlineState& state, int points_visible) {
  last_speed_m_s_ = state.velocity_world_m_s.norm();
  if (const std::string failure = FindFailure(state, points_visible); !failure.empty()) {
    Restart(failure, window_.last_solve_usable() &&
                         FindImpossible(state, options_.failure).empty() &&
                         window_.CalibrationBeyondLimit().empty());
    return std::nullopt;
  }
  start_pose_ = state.T_world_imu;
  return state;
}

// Tracks the lines beside the caller; invalid for methods on points alone. Those that follow one of
// the axes are preferred, where the method makes use of them.
std::future<void> Estimator::StartLines(const Quaterniond& R_now_previous,
                                        std::vector<LinePrediction> predictions,
                                        std::vector<Vector3d> axes_camera) {
  if (!lines_) return {};
  if (!UsesStructure(options_.method)) axes_camera.clear();
  return std::async(policy_, [this, R_now_previous, predictions = std::move(predictions),
                              axes_camera = std::move(axes_camera)] {
    const auto timed = clock_.Time("line tracking");
    lines_->Track(R_now_previous, predictions, axes_camera);
  });
}

// Once they are tracked.
void Estimator::TakeLines(std::future<void> tracked, FrameState* frame) const {
  if (!tracked.valid()) return;
  tracked.get();
  for (const LineObservation& line : lines_->observations()) {
    StereoLineMeasurement& measurement = frame->lines[line.id];
    measurement.left = PlaneFromPixel(rig_.cameras[0], line.left_px);
    measurement.camera = line.camera;
    if (line.right_px) {
      const RightRectification& right = rectifications_[line.camera + 1];
      measurement.right =
          LineSegment{right.GivenPlane(line.right_px->start), right.GivenPlane(line.right_px->end)};
    }
    measurement.timed = row_times_.Of(measurement.left, measurement.right, measurement.camera);
  }
}

bool Estimator::StandsStill(const FrameState& frame) const {
  constexpr double kMinTime_s = 0.3;  // less does not tell standing from moving slowly
  const FrameState& last = window_.newest();
  const Flow flow = MedianFlow(last, frame, rig_.cameras[0].fx_px);
  // Images that repeat show no motion either, but the gyroscope feels it.
  const Preintegration& imu = *frame.from_previous;
  const double turned_rad =
      LogRotation(imu.CorrectedFor(last.gyro_bias(), last.accel_bias()).rotation).norm();
  return flow.points >= options_.failure.min_points &&
         ToSeconds(frame.stamp_ns - last.stamp_ns) >= kMinTime_s &&
         turned_rad < kMaxStillRate_rad_s * imu.duration_s() && flow.median_px < kStillParallax_px;
}

// Whether images that stand still belie the IMU: since a rest it felt an acceleration, by which the
// points at their depths had moved in the images, as they do not where a lift takes all along.
bool Estimator::ViewIsCarried(const FrameState& frame) const {
  constexpr double kMinMoved_px = 5;  // that a movement along the view is seen as well
  const FrameState& last = window_.newest();
  if (!frame.stands_still || !last.rests_since_ns) return false;  // the bias is known of a rest
  std::vector<double> disparities;
  for (const auto& [id, measurement] : frame.measurements) {
    if (!measurement.right || measurement.camera != 0) continue;  // of the first pair
    disparities.push_back((measurement.left - *measurement.right).norm());
  }
  if (static_cast<int>(disparities.size()) < options_.failure.min_points) return false;
  const auto middle = disparities.begin() + static_cast<long>(disparities.size() / 2);
  std::nth_element(disparities.begin(), middle, disparities.end());
  const Vector3d baseline_m = rig_.T_imu_camera[1].translation - rig_.T_imu_camera[0].translation;
  const Preintegration::Motion felt =
      frame.from_previous->CorrectedFor(last.gyro_bias(), last.accel_bias());
  const double time_s = frame.from_previous->duration_s();
  const Quaterniond R_world_imu = last.T_world_imu().rotation * tracking_.R_body_imu;
  const Vector3d gravity_m_s2 = R_world_imu.conjugate() * Vector3d(0, 0, -kGravity_m_s2);
  const double gained_m_s = (felt.velocity_m_s + gravity_m_s2 * time_s).norm();
  const double moved_m = (felt.position_m + 0.5 * gravity_m_s2 * time_s * time_s).norm();
  return gained_m_s > kStartMaxStillAccelSigma_m_s2 * time_s &&
         rig_.cameras[0].fx_px * *middle * moved_m > kMinMoved_px * baseline_m.norm();
}

// The keyframe before a rest may show the rig while it still moved, by too little to be seen in the
// images and by centimetres along the view: another one is the first to show it at rest.
bool Estimator::BeginsRest(const FrameState& frame) const {
  const FrameState& last = window_.newest();
  return !last.stands_still && ToSeconds(frame.stamp_ns - last.stamp_ns) > kStandstillStep_s;
}

bool Estimator::IsKeyframe(const FrameState& frame) const {
  const FrameState& last = window_.newest();
  const KeyframeOptions& limits = options_.keyframes;
  const KeptPoints points = CountKept(window_.state(), frame, followed_);
  if (points.AreFewerThan(limits.min_kept_share)) return true;
  if (frame.stands_still) return BeginsRest(frame);
  std::vector<Quaterniond> turns;
  for (size_t i = 0; i < rig_.cameras.size(); ++i) {
    turns.push_back(CameraRotation(frame, last, rig_, static_cast<int>(i)));
  }
  const Flow flow = MedianFlow(last, frame, rig_.cameras[0].fx_px, turns);
  const bool sparse = points.True() < kSparseShare * options_.points.max_points;
  const double max_interval_s =
      sparse ? std::min(kSparseInterval_s, limits.max_interval_s) : limits.max_interval_s;
  return flow.median_px > limits.min_parallax_px ||
         ToSeconds(frame.stamp_ns - last.stamp_ns) > max_interval_s;
}

// Why the estimate cannot be trusted any longer; empty where it can.
std::string Estimator::FindFailure(const OnlineState& state, int points_visible) {
  const FailureOptions& limits = options_.failure;
  if (!window_.last_solve_usable()) return "the optimisation diverged";
  if (std::string impossible = FindImpossible(state, limits); !impossible.empty()) {
    return impossible;
  }
  if (const std::string item = window_.CalibrationBeyondLimit(); !item.empty()) {
    return "an estimate of the calibration beyond its limit: " + item +
           " (it is not estimated any longer)";
  }
  if (points_visible >= limits.min_points) {
    lost_since_ns_.reset();
  } else if (!lost_since_ns_) {
    lost_since_ns_ = state.stamp_ns;
  } else if (ToSeconds(state.stamp_ns - *lost_since_ns_) > kBareWalls * limits.max_lost_s) {
    return "no points to follow";
  }
  return {};
}

// Ends the segment, keeping it, and waits for a new initialisation.
void Estimator::Restart(const std::string& reason, bool calibration_is_good) {
  if (!window_.empty()) {
    spdlog::warn("segment {} ended: {}", segment_, reason);
    ++run_.warnings["segments ended by " + reason];
    window_.Collect(segment_, &run_);
    window_.AddContents(segment_, &run_);
    if (calibration_is_good) window_.LearnCalibration();
    window_.HoldCalibration();
    window_.Clear();
    cut_offset_ns_ = ToNanoseconds(window_.calibration().imu[kRowTimeOffset]);
    UpdateForTracking();
    ++segment_;
  }
  initializer_.Reset();
  source_->Reset();
  if (lines_) lines_->Reset();
  since_keyframe_.reset();
  followed_.reset();
  lost_since_ns_.reset();
  gyro_bias_rad_s_.setZero();
}

void Estimator::UpdateForTracking() {
  tracking_.offset_ns = std::min<int64_t>(cut_offset_ns_, 0);
  tracking_.errors = GetErrors(window_.calibration().imu.data());
  tracking_.R_body_imu = BodyFromImu(window_.calibration().imu.data()).rotation;
}

OnlineState Estimator::GetState(const FrameState& frame) const {
  OnlineState state;
  state.stamp_ns = frame.stamp_ns;
  state.segment = segment_;
  state.T_world_imu = frame.T_world_imu();
  state.velocity_world_m_s = frame.velocity();
  state.gyro_bias_rad_s = frame.gyro_bias();
  state.accel_bias_m_s2 = frame.accel_bias();
  return state;
}

}  // namespace slcmap::odometry
