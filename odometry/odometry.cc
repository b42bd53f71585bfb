#include "odometry/odometry.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <map>

#include "data/error.h"
#include "odometry/frontend/point_tracker.h"
#include "odometry/frontend/rectifier.h"
#include "odometry/imu/imu_buffer.h"
#include "odometry/window/initializer.h"
#include "odometry/window/sliding_window.h"
#include "odometry/stage_clock.h"

namespace slcmap {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;

Rig CheckedRig(const Rig& rig, const OdometryOptions& options) {
  options.Check();
  rig.cameras[0].Check("left camera");
  rig.cameras[1].Check("right camera");
  return rig;
}

}  // namespace

class Odometry::Impl {
 public:
  Impl(const Rig& rig, const OdometryOptions& options)
      : options_(options),
        rig_(CheckedRig(rig, options)),
        rectifier_(rig, options.rectifier),
        tracker_(options.points, rectifier_.rectified_rig(), rectifier_.mask(0)),
        initializer_(options.initializer, rectifier_.rectified_rig()),
        window_(options.window, rectifier_.rectified_rig()) {
    run_.method = MethodName(options.method);
    run_.rectified_rig = rectifier_.rectified_rig();
  }

  void AddImu(const ImuSample& sample) {
    if (!imu_.Add(sample)) Warn("IMU samples dropped (not finite, repeated or out of order)");
  }

  std::vector<OnlineState> AddStereo(const StereoImage& image) {
    if (Acceptable(image)) pending_.push_back(image);
    std::vector<OnlineState> states;
    while (!pending_.empty() && imu_.Covers(StampOnImuClock(pending_.front()))) {
      const StereoImage next = std::move(pending_.front());
      pending_.pop_front();
      if (const auto state = Process(next)) states.push_back(*state);
    }
    run_.states.insert(run_.states.end(), states.begin(), states.end());
    return states;
  }

  OdometryRun Run() const {
    OdometryRun run = run_;
    window_.AddContents(segment_, &run);
    run.timings.stages = clock_.Stages();
    return run;
  }

 private:
  // One image, stage by stage.
  std::optional<OnlineState> Process(const StereoImage& image) {
    const int64_t stamp_ns = StampOnImuClock(image);
    if (imu_.first_stamp_ns() > stamp_ns) {
      Warn("images dropped that came before the first IMU sample");
      return std::nullopt;
    }
    if (last_stamp_ns_ && imu_.LongestGap(*last_stamp_ns_, stamp_ns) > options_.failure.max_imu_gap_s) {
      Restart("a gap in the IMU samples");
    }
    TrackPoints(image, stamp_ns);
    std::optional<OnlineState> state =
        window_.empty() ? Initialize(image.stamp_ns, stamp_ns) : Estimate(image.stamp_ns, stamp_ns);
    last_stamp_ns_ = stamp_ns;
    imu_.DropBefore(stamp_ns);
    return state;
  }

  void TrackPoints(const StereoImage& image, int64_t stamp_ns) {
    const bool stereo = options_.method != Method::kPointsMono;
    cv::Mat left, right;
    {
      const auto timed = clock_.Time("rectification");
      left = rectifier_.Rectify(image.left, 0);
      if (stereo && !image.right.empty()) right = rectifier_.Rectify(image.right, 1);
    }
    const auto timed = clock_.Time("point tracking");
    tracker_.Track(left, right, PredictedCameraRotation(stamp_ns));
  }

  // The left camera now from the left camera at the last image, by the gyroscope.
  Quaterniond PredictedCameraRotation(int64_t stamp_ns) const {
    if (!last_stamp_ns_) return Quaterniond::Identity();
    Preintegration imu(rig_.imu_noise, gyro_bias_, Vector3d::Zero());
    for (const ImuSample& s : imu_.Between(*last_stamp_ns_, stamp_ns)) imu.Append(s);
    const Quaterniond R_last_now = imu.CorrectedFor(gyro_bias_, Vector3d::Zero()).rotation;
    const Quaterniond& R_imu_camera = run_.rectified_rig.T_imu_camera[0].rotation;
    return R_imu_camera.conjugate() * R_last_now.conjugate() * R_imu_camera;
  }

  std::unique_ptr<FrameState> NewFrame(int64_t stamp_ns) {
    auto frame = std::make_unique<FrameState>();
    frame->id = next_frame_id_++;
    frame->stamp_ns = stamp_ns;
    TakeMeasurements(frame.get());
    return frame;
  }

  void TakeMeasurements(FrameState* frame) const {
    const auto& cameras = run_.rectified_rig.cameras;
    const auto on_plane = [](const Camera& camera, const Vector2d& px) {
      return Vector2d((px.x() - camera.cx_px) / camera.fx_px, (px.y() - camera.cy_px) / camera.fy_px);
    };
    for (const PointObservation& point : tracker_.observations()) {
      StereoMeasurement& measurement = frame->measurements[point.id];
      measurement.left = on_plane(cameras[0], point.left_px);
      measurement.right.reset();
      if (point.right_px) measurement.right = on_plane(cameras[1], *point.right_px);
    }
  }

  void AppendImu(int64_t from_ns, int64_t to_ns, Preintegration* imu) const {
    const auto samples = imu_.Between(from_ns, to_ns);
    // Neighbouring intervals share their end sample.
    const size_t first = imu->samples().empty() ? 0 : 1;
    for (size_t i = first; i < samples.size(); ++i) imu->Append(samples[i]);
  }

  std::optional<OnlineState> Initialize(int64_t image_stamp_ns, int64_t stamp_ns) {
    const auto timed = clock_.Time("initialisation");
    tracker_.Detect();
    auto frame = NewFrame(stamp_ns);
    if (initializer_.size() > 0) {
      frame->from_previous =
          std::make_unique<Preintegration>(rig_.imu_noise, Vector3d::Zero(), Vector3d::Zero());
      AppendImu(*last_stamp_ns_, stamp_ns, frame->from_previous.get());
    }
    initializer_.AddFrame(std::move(frame));
    if (!initializer_.Ready()) return std::nullopt;
    const InitializationResult result = initializer_.Try(start_pose_, &window_);
    if (!result.success) {
      Warn("attempts at initialisation that failed");
      spdlog::debug("{}", result.report);
      return std::nullopt;
    }
    spdlog::info("segment {} {}", segment_, result.report);
    gyro_bias_ = window_.newest().gyro_bias();
    lost_since_ns_.reset();
    return StateOf(window_.newest(), image_stamp_ns);
  }

  std::optional<OnlineState> Estimate(int64_t image_stamp_ns, int64_t stamp_ns) {
    std::unique_ptr<FrameState> frame = NewFrame(stamp_ns);
    frame->from_previous = std::move(since_keyframe_);
    if (!frame->from_previous) {
      frame->from_previous = std::make_unique<Preintegration>(
          rig_.imu_noise, window_.newest().gyro_bias(), window_.newest().accel_bias());
    }
    AppendImu(*last_stamp_ns_, stamp_ns, frame->from_previous.get());
    frame->stands_still = StandsStill(*frame);
    {
      const auto timed = clock_.Time("frame estimation");
      window_.Predict(frame.get());
      tracker_.Remove(window_.Track(frame.get()));
    }
    const bool is_keyframe = IsKeyframe(*frame);
    OnlineState state;
    if (is_keyframe) {
      AddKeyframe(std::move(frame));
      state = StateOf(window_.newest(), image_stamp_ns);
    } else {
      state = StateOf(*frame, image_stamp_ns);
      since_keyframe_ = std::move(frame->from_previous);
    }
    gyro_bias_ = state.gyro_bias_rad_s;
    if (const std::string failure = FindFailure(state, stamp_ns); !failure.empty()) {
      Restart(failure);
      return std::nullopt;
    }
    start_pose_ = state.T_world_imu;
    return state;
  }

  void AddKeyframe(std::unique_ptr<FrameState> frame) {
    {
      const auto timed = clock_.Time("point detection");
      tracker_.Detect();
    }
    // What tracking found to be an outlier is gone from the tracker; the new points come in.
    const auto judged = frame->measurements;
    frame->measurements.clear();
    TakeMeasurements(frame.get());
    for (const auto& [id, measurement] : judged) {
      const auto it = frame->measurements.find(id);
      if (it != frame->measurements.end()) it->second = measurement;
    }
    const auto timed = clock_.Time("window optimisation");
    tracker_.Remove(window_.AddKeyframe(std::move(frame)));
    window_.Collect(segment_, &run_);
  }

  bool StandsStill(const FrameState& frame) const {
    constexpr double kMinTime_s = 0.3;  // less does not tell standing from moving slowly
    const FrameState& last = window_.newest();
    const Flow flow = MedianFlow(last, frame, FocalLength());
    return flow.points >= options_.failure.min_points &&
           ToSeconds(frame.stamp_ns - last.stamp_ns) >= kMinTime_s &&
           flow.median_px < options_.keyframes.still_parallax_px;
  }

  bool IsKeyframe(const FrameState& frame) const {
    const FrameState& last = window_.newest();
    const Quaterniond& R_imu_camera = run_.rectified_rig.T_imu_camera[0].rotation;
    const Quaterniond R_now_last = R_imu_camera.conjugate() *
                                   frame.T_world_imu().rotation.conjugate() *
                                   last.T_world_imu().rotation * R_imu_camera;
    const Flow flow = MedianFlow(last, frame, FocalLength(), R_now_last);
    const KeyframeOptions& limits = options_.keyframes;
    const auto in_last = static_cast<double>(last.measurements.size());
    if (flow.points < limits.min_kept_share * in_last) return true;
    if (frame.stands_still) return false;
    return flow.median_px > limits.min_parallax_px ||
           ToSeconds(frame.stamp_ns - last.stamp_ns) > limits.max_interval_s;
  }

  // Why the estimate cannot be trusted any longer; empty where it can.
  std::string FindFailure(const OnlineState& state, int64_t stamp_ns) {
    const FailureOptions& limits = options_.failure;
    if (!state.T_world_imu.translation.allFinite() || !window_.last_solve_usable()) {
      return "the optimisation diverged";
    }
    if (state.velocity_world_m_s.norm() > limits.max_speed_m_s) return "an impossible speed";
    if (state.gyro_bias_rad_s.norm() > limits.max_gyro_bias_rad_s) {
      return "an impossible gyroscope bias";
    }
    if (state.accel_bias_m_s2.norm() > limits.max_accel_bias_m_s2) {
      return "an impossible accelerometer bias";
    }
    if (static_cast<int>(tracker_.observations().size()) >= limits.min_points) {
      lost_since_ns_.reset();
    } else if (!lost_since_ns_) {
      lost_since_ns_ = stamp_ns;
    } else if (ToSeconds(stamp_ns - *lost_since_ns_) > limits.max_lost_s) {
      return "no points to follow";
    }
    return {};
  }

  // Ends the segment, keeping it, and waits for a new initialisation.
  void Restart(const std::string& reason) {
    if (!window_.empty()) {
      spdlog::warn("segment {} ended: {}", segment_, reason);
      Warn("segments ended by " + reason);
      window_.Collect(segment_, &run_);
      window_.AddContents(segment_, &run_);
      window_.Clear();
      ++segment_;
    }
    initializer_.Reset();
    tracker_.Reset();
    since_keyframe_.reset();
    lost_since_ns_.reset();
    gyro_bias_.setZero();
  }

  OnlineState StateOf(const FrameState& frame, int64_t image_stamp_ns) const {
    OnlineState state;
    state.stamp_ns = image_stamp_ns;
    state.segment = segment_;
    state.T_world_imu = frame.T_world_imu();
    state.velocity_world_m_s = frame.velocity();
    state.gyro_bias_rad_s = frame.gyro_bias();
    state.accel_bias_m_s2 = frame.accel_bias();
    return state;
  }

  bool Acceptable(const StereoImage& image) {
    const auto fits = [&](const cv::Mat& m, int camera) {
      return m.type() == CV_8UC1 && m.cols == rig_.cameras[camera].width_px &&
             m.rows == rig_.cameras[camera].height_px;
    };
    if (last_image_ns_ && image.stamp_ns <= *last_image_ns_) {
      Warn("images dropped that were repeated or out of order");
      return false;
    }
    if (!fits(image.left, 0) || (!image.right.empty() && !fits(image.right, 1))) {
      Warn("images dropped that were empty or not of the calibrated size and type");
      return false;
    }
    last_image_ns_ = image.stamp_ns;
    return true;
  }

  int64_t StampOnImuClock(const StereoImage& image) const {
    return image.stamp_ns + ToNanoseconds(rig_.camera_time_offset_s);
  }

  double FocalLength() const { return run_.rectified_rig.cameras[0].fx_px; }
  void Warn(const std::string& kind) { ++run_.warnings[kind]; }

  OdometryOptions options_;
  Rig rig_;
  Rectifier rectifier_;
  PointTracker tracker_;
  ImuBuffer imu_;
  Initializer initializer_;
  SlidingWindow window_;
  StageClock clock_;

  std::deque<StereoImage> pending_;
  std::unique_ptr<Preintegration> since_keyframe_;  // up to the last image that was no keyframe
  Vector3d gyro_bias_ = Vector3d::Zero();
  std::optional<int64_t> last_stamp_ns_, last_image_ns_, lost_since_ns_;
  std::optional<RigidTransform> start_pose_;  // where a new segment starts
  int64_t next_frame_id_ = 0;
  int segment_ = 0;
  OdometryRun run_;
};

Odometry::Odometry(const Rig& rig, const OdometryOptions& options)
    : impl_(std::make_unique<Impl>(rig, options)) {}
Odometry::~Odometry() = default;
void Odometry::AddImu(const ImuSample& sample) { impl_->AddImu(sample); }
std::vector<OnlineState> Odometry::AddStereo(const StereoImage& image) {
  return impl_->AddStereo(image);
}
OdometryRun Odometry::Run() const { return impl_->Run(); }

}  // namespace slcmap
