#include "odometry/window/initializer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "odometry/geometry/imu.h"
#include "odometry/window/linear_alignment.h"
#include "odometry/window/point_landmarks.h"

namespace slcmap::inline odometry {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kMaxStillFlow_px = 1.0;  // at rest: median motion of the points over the window
constexpr double kMaxGravityError_m_s2 = 1.0;  // in motion: of the estimated gravity's size

constexpr int kMotionRounds = 2;
constexpr int kMaxMotionRounds = 5;  // where the time offset has not settled
constexpr int64_t kOffsetSettled_ns = 1'000'000;
// One camera has its scale from the accelerometer alone, which a short window of a slow walk does
// not tell: after a failure it grows, by so much an attempt, up to the longest.
constexpr double kShortestOfOneCamera_s = 1.5, kLongestOfOneCamera_s = 2.0, kGrows_s = 0.1;
constexpr double kBiasPairs_s = 0.25;    // between images that tell the gyroscope's bias
constexpr double kMaxAccelScale = 0.04;  // of a low-cost accelerometer, that one camera tolerates
constexpr size_t kMostKeyframes = 10;    // that a window is started with

// The geometry of the cameras against the true place of the IMU, as it is estimated.
StereoGeometry GeometryFromImu(const CostModel& model, const RigidTransform& T_imu_body) {
  const StereoGeometry corrected = model.Corrected(model.geometry);
  std::vector<RigidTransform> cameras = corrected.T_imu_camera;
  for (RigidTransform& pose : cameras) pose = T_imu_body * pose;
  StereoGeometry geometry(cameras, corrected.weight);
  geometry.lenses = corrected.lenses;
  geometry.lens_shifts = corrected.lens_shifts;
  return geometry;
}

std::vector<ImuSample> AllSamples(const std::vector<std::unique_ptr<FrameState>>& frames) {
  std::vector<ImuSample> all;
  for (const auto& frame : frames) {
    if (!frame->from_previous) continue;
    const auto& samples = frame->from_previous->samples();
    all.insert(all.end(), samples.begin() + (all.empty() ? 0 : 1), samples.end());
  }
  return all;
}

bool HasOneCamera(const std::vector<std::unique_ptr<FrameState>>& frames) {
  for (const auto& frame : frames) {
    for (const auto& [id, measurement] : frame->measurements) {
      if (measurement.right) return false;
    }
  }
  return true;
}

// The size of gravity as an accelerometer of some scale feels it: the mean of what it felt, in the
// axes of the first frame, but for the change of velocity.
double FeltGravity_m_s2(const std::vector<std::unique_ptr<FrameState>>& frames,
                        const ImuNoise& noise, const Vector3d& gyro_bias_rad_s,
                        const ImuErrors& errors) {
  Preintegration imu(noise, gyro_bias_rad_s, Vector3d::Zero(), errors);
  for (const ImuSample& sample : AllSamples(frames)) imu.Append(sample);
  const auto motion = imu.CorrectedFor(gyro_bias_rad_s, Vector3d::Zero(), errors);
  return std::clamp(motion.velocity_m_s.norm() / imu.duration_s(),
                    (1 - kMaxAccelScale) * kGravity_m_s2, (1 + kMaxAccelScale) * kGravity_m_s2);
}

// The world that has its z axis against gravity, and in which the first body frame has the position
// and heading of `start` (zero where there is none).
RigidTransform WorldFromFirst(const Vector3d& gravity_first,
                              const std::optional<RigidTransform>& start) {
  const Quaterniond level = Quaterniond::FromTwoVectors(gravity_first, -Vector3d::UnitZ());
  if (!start) return {level, Vector3d::Zero()};
  // The turn about z that brings the levelled body nearest to the one that is wanted.
  const Quaterniond difference = start->rotation * level.conjugate();
  const double yaw_rad = 2.0 * std::atan2(difference.z(), difference.w());
  return {Quaterniond(Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ())) * level, start->translation};
}

void SetState(const RigidTransform& pose, const Vector3d& velocity, const Vector3d& gyro_bias,
              FrameState* frame) {
  PoseToBlock(pose, frame->pose.data());
  frame->speed_bias.fill(0);
  std::copy_n(velocity.data(), 3, frame->speed_bias.begin());
  std::copy_n(gyro_bias.data(), 3, frame->speed_bias.begin() + 3);
}

}  // namespace

Flow MedianFlow(const FrameState& a, const FrameState& b, double focal_px,
                const std::vector<Quaterniond>& R_b_a) {
  std::vector<double> distances_px;
  for (const auto& [id, in_b] : b.measurements) {
    const auto in_a = a.measurements.find(id);
    if (in_a == a.measurements.end()) continue;
    const Vector3d seen = in_a->second.left.homogeneous();
    const Vector3d ray = R_b_a.empty() ? seen : R_b_a[in_b.camera] * seen;
    if (ray.z() < 0.1) continue;
    distances_px.push_back(focal_px * (ray.head<2>() / ray.z() - in_b.left).norm());
  }
  if (distances_px.empty()) return {};
  const auto middle = distances_px.begin() + static_cast<long>(distances_px.size() / 2);
  std::nth_element(distances_px.begin(), middle, distances_px.end());
  return {*middle, static_cast<int>(distances_px.size())};
}

Initializer::Initializer(const InitializerOptions& options, const Rig& rectified_rig)
    : options_(options), window_s_(kStartWindow_s), rig_(rectified_rig) {}

void Initializer::AddFrame(std::unique_ptr<FrameState> frame) {
  if (frames_.empty()) frame->from_previous.reset();
  frames_.push_back(std::move(frame));
}

bool Initializer::Ready() const {
  // Half a millisecond of tolerance: stamps of a regular camera are rounded.
  return frames_.size() >= 4 && Span_s() >= window_s_ - 5e-4;
}

InitializationResult Initializer::Try(const std::optional<RigidTransform>& start,
                                      const ImuBuffer& imu, SlidingWindow* window) {
  const double focal_px = rig_.cameras[0].fx_px;
  const Flow flow = MedianFlow(*frames_.front(), *frames_.back(), focal_px);
  InitializationResult result;
  // Blur costs one camera most of its points over so long a time; those between count as well.
  const int needed = HasOneCamera(frames_) ? options_.min_points / 2 : options_.min_points;
  if (flow.points < needed) {
    result.report = fmt::format("not initialised: {} points seen throughout (at least {})",
                                flow.points, needed);
  } else if (flow.median_px <= kMaxStillFlow_px) {
    result = TryAtRest(start, window);
  } else if (HasOneCamera(frames_) && Span_s() < kShortestOfOneCamera_s) {
    result.report =
        fmt::format("not initialised: {:.1f} s of motion before one camera (at least {:.1f})",
                    Span_s(), kShortestOfOneCamera_s);
  } else {
    result = TryInMotion(start, imu, window);
  }
  result.report +=
      fmt::format("; flow {:.2f} px (at rest: at most {:.2f})", flow.median_px, kMaxStillFlow_px);
  if (!result.success) RemoveOldest();
  return result;
}

double Initializer::Span_s() const {
  return ToSeconds(frames_.back()->stamp_ns - frames_.front()->stamp_ns);
}

// What to look at next time: of one camera more, else newer data.
void Initializer::RemoveOldest() {
  if (HasOneCamera(frames_) && Span_s() + kGrows_s <= kLongestOfOneCamera_s) {
    window_s_ = Span_s() + kGrows_s;
    return;
  }
  window_s_ = kStartWindow_s;
  const size_t count = std::max<size_t>(1, frames_.size() / 4);
  frames_.erase(frames_.begin(), frames_.begin() + static_cast<long>(count));
  if (!frames_.empty()) frames_.front()->from_previous.reset();
}

InitializationResult Initializer::TryAtRest(const std::optional<RigidTransform>& start,
                                            SlidingWindow* window) {
  const std::vector<ImuSample> samples = AllSamples(frames_);
  const ImuSpread gyro = ComputeSpread(samples, &ImuSample::angular_velocity_rad_s);
  const ImuSpread accel = ComputeSpread(samples, &ImuSample::specific_force_m_s2);
  const double gravity_error = std::abs(accel.mean.norm() - kGravity_m_s2);
  InitializationResult result;
  result.at_rest = true;
  result.success = gyro.sigma <= kStartMaxStillGyroSigma_rad_s &&
                   accel.sigma <= kStartMaxStillAccelSigma_m_s2 &&
                   gravity_error <= kMaxGravityError_m_s2;
  result.report = fmt::format(
      "{} at rest: deviation of the gyroscope {:.4f} rad/s (at most {:.4f}), of the accelerometer "
      "{:.3f} m/s^2 (at most {:.3f}), gravity off by {:.3f} m/s^2 (at most {:.3f})",
      result.success ? "initialised" : "not initialised", gyro.sigma, kStartMaxStillGyroSigma_rad_s,
      accel.sigma, kStartMaxStillAccelSigma_m_s2, gravity_error, kMaxGravityError_m_s2);
  if (!result.success) return result;
  std::vector<std::unique_ptr<FrameState>> first;
  first.push_back(std::move(frames_.back()));
  first.front()->from_previous.reset();
  first.front()->stands_still = true;
  const RigidTransform T_imu_body = BodyFromImu(window->calibration().imu.data()).Inverse();
  SetState(WorldFromFirst(-accel.mean, start) * T_imu_body, Vector3d::Zero(), gyro.mean,
           first.front().get());
  result.finished = window->Start(std::move(first));
  frames_.clear();
  return result;
}

// Copies of every second frame, or fewer (the newest among them), with the states that the
// alignment gave them.
std::vector<std::unique_ptr<FrameState>> Initializer::EverySecond(
    const LinearAlignment& alignment, const RigidTransform& T_world_first,
    const RigidTransform& T_imu_body, const Vector3d& gyro_bias) const {
  std::vector<std::unique_ptr<FrameState>> out;
  std::unique_ptr<Preintegration> imu;
  const size_t every = std::max<size_t>(2, (frames_.size() + kMostKeyframes - 1) / kMostKeyframes);
  for (size_t i = 0; i < frames_.size(); ++i) {
    if (imu) {
      const auto& samples = frames_[i]->from_previous->samples();
      const size_t first = imu->samples().empty() ? 0 : 1;  // neighbours share their end samples
      for (size_t k = first; k < samples.size(); ++k) imu->Append(samples[k]);
    }
    if ((frames_.size() - 1 - i) % every != 0) continue;
    auto frame = std::make_unique<FrameState>();
    frame->id = frames_[i]->id;
    frame->stamp_ns = frames_[i]->stamp_ns;
    frame->cut = frames_[i]->cut;
    frame->measurements = frames_[i]->measurements;
    frame->lines = frames_[i]->lines;
    frame->felt = frames_[i]->felt;
    frame->from_previous = std::move(imu);
    const LinearState& state = alignment.states[i];
    SetState(T_world_first * state.T_first_imu * T_imu_body,
             T_world_first.rotation * state.velocity_first_m_s, gyro_bias, frame.get());
    out.push_back(std::move(frame));
    imu = std::make_unique<Preintegration>(rig_.imu_noise, gyro_bias, Vector3d::Zero());
  }
  return out;
}

void Initializer::CutAgain(const ImuBuffer& imu, int64_t offset_ns) {
  if (frames_.back()->cut.offset_ns == offset_ns) return;
  for (size_t i = 0; i < frames_.size(); ++i) {
    FrameState& frame = *frames_[i];
    frame.cut = MakeCut(imu, frame.stamp_ns, offset_ns);
    if (i > 0) {
      frame.from_previous->Replace(
          imu.Between(frames_[i - 1]->cut_stamp_ns(), frame.cut_stamp_ns()));
    }
  }
}

InitializationResult Initializer::TryInMotion(const std::optional<RigidTransform>& start,
                                              const ImuBuffer& imu, SlidingWindow* window) {
  InitializationResult result;
  const CalibrationPrior known = window->calibration_prior();
  const int64_t known_offset_ns = frames_.back()->cut.offset_ns;
  // What the attempt has found of the calibration fails with it.
  const auto fail = [&] {
    window->ResetCalibration(known);
    CutAgain(imu, known_offset_ns);
  };
  double gravity_error = 0, rms = 0;
  int landmarks = 0;
  Vector3d gyro_bias = Vector3d::Zero();
  double felt_gravity_m_s2 = kGravity_m_s2;
  if (HasOneCamera(frames_)) {
    gyro_bias = GyroBiasFromImages(frames_, GeometryFromImu(window->model(), RigidTransform()),
                                   rig_.imu_noise, kBiasPairs_s)
                    .value_or(gyro_bias);
    felt_gravity_m_s2 = FeltGravity_m_s2(frames_, rig_.imu_noise, gyro_bias,
                                         GetErrors(window->calibration().imu.data()));
  }
  // The first round knows no gyroscope bias; what its optimisation finds makes the second one
  // exact. A time offset that is far off takes some more.
  bool settled = false;
  for (int round = 0; round < (settled ? kMotionRounds : kMaxMotionRounds); ++round) {
    const RigidTransform T_imu_body = BodyFromImu(window->calibration().imu.data()).Inverse();
    const auto alignment =
        AlignLinearly(frames_, GeometryFromImu(window->model(), T_imu_body), rig_.imu_noise,
                      gyro_bias, GetErrors(window->calibration().imu.data()), felt_gravity_m_s2);
    if (!alignment) {
      fail();
      result.report = "not initialised in motion: the motion does not tell velocity and gravity";
      return result;
    }
    gravity_error = std::abs(alignment->free_gravity_m_s2 - felt_gravity_m_s2);
    const RigidTransform T_world_first = WorldFromFirst(alignment->gravity_first_m_s2, start);
    result.finished = window->Start(EverySecond(*alignment, T_world_first, T_imu_body, gyro_bias));
    gyro_bias = window->newest().gyro_bias();
    rms = ReprojectionRms(window->model(), window->state());
    landmarks = TriangulatedCount(window->state());
    // As far as samples are certain to be there.
    const int64_t offset_ns =
        std::clamp(ToNanoseconds(window->calibration().imu[kRowTimeOffset]),
                   std::min<int64_t>(0, imu.first_stamp_ns() - frames_.front()->stamp_ns),
                   std::max<int64_t>(0, frames_.back()->cut.offset_ns));
    settled = std::abs(offset_ns - frames_.back()->cut.offset_ns) < kOffsetSettled_ns;
    if (!settled) CutAgain(imu, offset_ns);
  }
  result.success = gravity_error <= kMaxGravityError_m_s2 &&
                   rms <= options_.max_reprojection_sigma && landmarks >= options_.min_points;
  result.report = fmt::format(
      "{} in motion: gravity off by {:.3f} m/s^2 (at most {:.3f}), reprojection RMS {:.2f} sigma "
      "(at most {:.2f}), {} points (at least {})",
      result.success ? "initialised" : "not initialised", gravity_error, kMaxGravityError_m_s2, rms,
      options_.max_reprojection_sigma, landmarks, options_.min_points);
  if (result.success) {
    frames_.clear();
  } else {
    fail();
  }
  return result;
}

}  // namespace slcmap::odometry
