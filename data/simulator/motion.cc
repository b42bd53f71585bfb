#include "data/simulator/motion.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Sparse>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "data/core/error.h"
#include "data/core/types.h"

namespace slcmap::inline data {
namespace {

constexpr double kKnotInterval_s = 0.1;
constexpr double kJump_m = 0.003;   // errors beyond these count as jumps of the trajectory,
constexpr double kJump_rad = 0.01;  // which the motion does not follow
constexpr int kIterations = 10;

constexpr int kOrder = MotionSpline::kOrder;
using Weights = std::array<double, kOrder>;

// The weights of the control poses at u in [0, 1], differentiated `derivative` times by u: the
// recursion of Cox and de Boor for uniform knots.
Weights BasisWeights(double u, int derivative) {
  Weights w = {1.0};
  for (int order = 2; order <= kOrder; ++order) {
    const bool differentiate = order > kOrder - derivative;
    for (int j = order - 1; j >= 0; --j) {
      const double before = j > 0 ? w[j - 1] : 0.0;
      const double same = j < order - 1 ? w[j] : 0.0;
      w[j] = differentiate ? before - same
                           : ((u + order - 1 - j) * before + (j + 1 - u) * same) / (order - 1);
    }
  }
  return w;
}

// The sum of the weights from each control pose to the last.
Weights Cumulate(Weights w) {
  for (int j = kOrder - 2; j >= 0; --j) w[j] += w[j + 1];
  return w;
}

}  // namespace

MotionSpline::MotionSpline(double knot_interval_s,
                           const std::vector<RigidTransform>& T_world_imu_control)
    : knot_interval_s_(knot_interval_s), control_(T_world_imu_control) {
  if (control_.size() < kOrder) {
    throw DataError("motion: found " + std::to_string(control_.size()) +
                    " control poses, expected at least " + std::to_string(kOrder));
  }
  begin_s_ = 0;
  end_s_ = knot_interval_s * static_cast<double>(control_.size() + 1 - kOrder);
  for (size_t j = 0; j + 1 < control_.size(); ++j) {
    increments_rad_.push_back(
        LogRotation(control_[j].rotation.conjugate() * control_[j + 1].rotation));
  }
}

MotionSpline MotionSpline::Slice(double from_s, double duration_s) const {
  if (!(from_s >= 0 && from_s < Duration() && duration_s > 0)) {
    throw DataError("motion: it lasts " + std::to_string(Duration()) + " s, found a part from " +
                    std::to_string(from_s) + " s for " + std::to_string(duration_s) + " s");
  }
  MotionSpline slice = *this;
  slice.begin_s_ = begin_s_ + from_s;
  slice.end_s_ = std::min(end_s_, slice.begin_s_ + duration_s);
  return slice;
}

MotionSpline::Place MotionSpline::Locate(double t_s) const {
  const double last = static_cast<double>(control_.size() - kOrder);
  const double s = std::clamp(begin_s_ + t_s, begin_s_, end_s_) / knot_interval_s_;
  const double first = std::min(std::floor(s), last);
  return {static_cast<size_t>(first), s - first};
}

Eigen::Vector3d MotionSpline::PositionDerivative(double t_s, int derivative) const {
  const Place place = Locate(t_s);
  const Weights w = BasisWeights(place.u, derivative);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int j = 0; j < kOrder; ++j) sum += w[j] * control_[place.first + j].translation;
  return sum / std::pow(knot_interval_s_, derivative);
}

struct MotionSpline::Rotation {
  Eigen::Quaterniond R_world_imu;
  Eigen::Vector3d velocity_rad_s = Eigen::Vector3d::Zero();
};

// R = R_0 prod_j Exp(b_j d_j) with cumulative weights b and increments d; the derivative follows
// from the product rule, one factor A_j = Exp(b_j d_j) after the other.
MotionSpline::Rotation MotionSpline::RotationAt(double t_s) const {
  const Place place = Locate(t_s);
  const double rate = 1.0 / knot_interval_s_;
  const Weights b = Cumulate(BasisWeights(place.u, 0));
  const Weights db = Cumulate(BasisWeights(place.u, 1));
  Rotation r{control_[place.first].rotation};
  for (int j = 1; j < kOrder; ++j) {
    const Eigen::Vector3d& d = increments_rad_[place.first + j - 1];
    const Eigen::Quaterniond factor = ExpRotation(b[j] * d);
    const Eigen::Vector3d carried = factor.conjugate() * r.velocity_rad_s;
    r.velocity_rad_s = carried + d * (db[j] * rate);
    r.R_world_imu = (r.R_world_imu * factor).normalized();
  }
  return r;
}

RigidTransform MotionSpline::PoseAt(double t_s) const {
  return {RotationAt(t_s).R_world_imu, PositionDerivative(t_s, 0)};
}

Eigen::Vector3d MotionSpline::VelocityAt(double t_s) const { return PositionDerivative(t_s, 1); }

Eigen::Vector3d MotionSpline::AccelerationAt(double t_s) const {
  return PositionDerivative(t_s, 2);
}

Eigen::Vector3d MotionSpline::AngularVelocityAt(double t_s) const {
  return RotationAt(t_s).velocity_rad_s;
}

Eigen::Quaterniond CameraLookingAlong(const Eigen::Vector3d& forward_world) {
  Eigen::Matrix3d R_world_camera;
  R_world_camera.col(2) = forward_world.normalized();
  R_world_camera.col(0) = R_world_camera.col(2).cross(Eigen::Vector3d::UnitZ()).normalized();
  R_world_camera.col(1) = R_world_camera.col(2).cross(R_world_camera.col(0));
  return Eigen::Quaterniond(R_world_camera);
}

void MotionFitOptions::Check() const {
  if (!(smoothing > 0)) throw ConfigError("smoothing: expected a positive number");
}

namespace {

// Least squares of control values whose weighted sums are to match values at given times. The
// control values of one motion are few to an instant, so that the normal equations are a narrow
// band.
class BandedFit {
 public:
  BandedFit(const std::vector<double>& times_s, size_t controls, const MotionFitOptions& options)
      : times_(times_s.size(), controls),
        third_differences_(controls - 3, controls),
        smoothing_(options.smoothing) {
    std::vector<Eigen::Triplet<double>> entries;
    for (size_t row = 0; row < times_s.size(); ++row) {
      const double s = times_s[row] / kKnotInterval_s;
      const double first = std::min(std::floor(s), static_cast<double>(controls - kOrder));
      const Weights w = BasisWeights(s - first, 0);
      for (int j = 0; j < kOrder; ++j) entries.emplace_back(row, static_cast<int>(first) + j, w[j]);
    }
    times_.setFromTriplets(entries.begin(), entries.end());
    entries.clear();
    for (size_t row = 0; row + 3 < controls; ++row) {
      const double w[4] = {-1, 3, -3, 1};
      for (int j = 0; j < 4; ++j) entries.emplace_back(row, row + j, w[j]);
    }
    third_differences_.setFromTriplets(entries.begin(), entries.end());
  }

  // The change (controls x 3) of control values (controls x 3) that takes away the errors (times x
  // 3). Errors beyond `jump` count little (Cauchy's weights): they are jumps of the trajectory,
  // over which the motion is to glide.
  Eigen::MatrixX3d Solve(const Eigen::MatrixX3d& errors, double jump,
                         const Eigen::MatrixX3d& control) const {
    const Eigen::VectorXd weights =
        (1 + errors.rowwise().squaredNorm().array() / (jump * jump)).inverse();
    const Matrix weighted = times_.transpose() * weights.asDiagonal();
    const Matrix rough = smoothing_ * Matrix(third_differences_.transpose() * third_differences_);
    const Eigen::SimplicialLDLT<Matrix> solver(Matrix(weighted * times_) + rough);
    return solver.solve(Eigen::MatrixX3d(weighted * errors) - Eigen::MatrixX3d(rough * control));
  }

 private:
  using Matrix = Eigen::SparseMatrix<double>;
  Matrix times_;
  Matrix third_differences_;
  double smoothing_;
};

struct Errors {
  Eigen::MatrixX3d position_m, rotation_rad;  // both in world
};

Errors GetErrors(const MotionSpline& motion, const Trajectory& trajectory,
                 const std::vector<double>& times_s, const Progress& progress) {
  Errors errors{Eigen::MatrixX3d(times_s.size(), 3), Eigen::MatrixX3d(times_s.size(), 3)};
  for (size_t i = 0; i < times_s.size(); ++i) {
    if (i % 1024 == 0) {
      progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(times_s.size()));
    }
    const RigidTransform& truth = trajectory[i].T_world_imu;
    const RigidTransform pose = motion.PoseAt(times_s[i]);
    errors.position_m.row(i) = truth.translation - pose.translation;
    errors.rotation_rad.row(i) = LogRotation(truth.rotation * pose.rotation.conjugate());
  }
  return errors;
}

// Control poses on the trajectory itself: the starting values of the fit.
std::vector<RigidTransform> InitialControl(const Trajectory& trajectory,
                                           const std::vector<double>& times_s, size_t controls,
                                           double knot_interval_s) {
  std::vector<RigidTransform> control;
  size_t after = 1;
  for (size_t j = 0; j < controls; ++j) {
    const double t_s = (static_cast<double>(j) - 2) * knot_interval_s;
    while (after + 1 < times_s.size() && times_s[after] < t_s) ++after;
    const double u = (t_s - times_s[after - 1]) / (times_s[after] - times_s[after - 1]);
    control.push_back(Interpolate(trajectory[after - 1].T_world_imu, trajectory[after].T_world_imu,
                                  std::clamp(u, 0.0, 1.0)));
  }
  return control;
}

// Rotation vectors of the control poses from one to the next, summed up: their differences are the
// increments of the spline, up to the turn of the frame within one interval.
Eigen::MatrixX3d UnrolledRotations(const std::vector<RigidTransform>& control) {
  Eigen::MatrixX3d sums(control.size(), 3);
  sums.row(0).setZero();
  for (size_t j = 1; j < control.size(); ++j) {
    sums.row(j) =
        sums.row(j - 1) +
        LogRotation(control[j].rotation * control[j - 1].rotation.conjugate()).transpose();
  }
  return sums;
}

Eigen::MatrixX3d Positions(const std::vector<RigidTransform>& control) {
  Eigen::MatrixX3d positions(control.size(), 3);
  for (size_t j = 0; j < control.size(); ++j) positions.row(j) = control[j].translation;
  return positions;
}

double RootMeanSquareOfRows(const Eigen::MatrixX3d& rows) {
  return std::sqrt(rows.rowwise().squaredNorm().mean());
}

}  // namespace

MotionFit FitMotion(const Trajectory& trajectory, const MotionFitOptions& options,
                    const Progress& progress) {
  options.Check();
  if (trajectory.size() < 2) throw DataError("motion: expected a trajectory of two poses or more");
  std::vector<double> times_s;
  for (const StampedPose& pose : trajectory) {
    times_s.push_back(ToSeconds(pose.stamp_ns - trajectory.front().stamp_ns));
  }
  if (times_s.back() > kMaxMotion_s) {
    throw DataError("motion: found a trajectory of " + std::to_string(times_s.back()) +
                    " s, expected at most " + std::to_string(kMaxMotion_s) + " s");
  }
  const double knot_s = kKnotInterval_s;
  const size_t controls = static_cast<size_t>(std::ceil(times_s.back() / knot_s)) + kOrder - 1;
  std::vector<RigidTransform> control = InitialControl(trajectory, times_s, controls, knot_s);
  const BandedFit fit(times_s, controls, options);

  // A turn delta of control pose j in world turns the spline by about its weight times delta, so
  // that rotations are fitted as positions are, repeated until the rest is gone.
  for (int i = 0; i < kIterations; ++i) {
    const Progress part = progress.Part(1.0 * i / kIterations, (i + 1.0) / kIterations);
    const Errors errors = GetErrors(MotionSpline(knot_s, control), trajectory, times_s, part);
    const Eigen::MatrixX3d turn =
        fit.Solve(errors.rotation_rad, kJump_rad, UnrolledRotations(control));
    const Eigen::MatrixX3d shift = fit.Solve(errors.position_m, kJump_m, Positions(control));
    for (size_t j = 0; j < controls; ++j) {
      control[j].rotation = (ExpRotation(turn.row(j)) * control[j].rotation).normalized();
      control[j].translation += shift.row(j).transpose();
    }
  }
  const MotionSpline motion(knot_s, control);
  const Errors errors = GetErrors(motion, trajectory, times_s, progress.Part(1, 1));
  return {motion, RootMeanSquareOfRows(errors.position_m),
          std::sqrt(errors.position_m.rowwise().squaredNorm().maxCoeff()),
          RootMeanSquareOfRows(errors.rotation_rad),
          std::sqrt(errors.rotation_rad.rowwise().squaredNorm().maxCoeff())};
}

namespace {

constexpr int64_t kMaxSamples = 4'000'000;  // of 4 hours at 277 Hz; 0.5 GB

class NormalVectors {
 public:
  explicit NormalVectors(uint64_t seed) : generator_(seed) {}

  Eigen::Vector3d Draw(double sigma) {
    Eigen::Vector3d v;
    for (int k = 0; k < 3; ++k) v[k] = sigma * normal_(generator_);
    return v;
  }

 private:
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
};

ImuSample ExactSample(const MotionSpline& motion, double t_s) {
  const Eigen::Vector3d up_m_s2(0, 0, kGravity_m_s2);
  const Eigen::Quaterniond R_imu_world = motion.PoseAt(t_s).rotation.conjugate();
  return {0, motion.AngularVelocityAt(t_s), R_imu_world * (motion.AccelerationAt(t_s) + up_m_s2)};
}

}  // namespace

void ImuSimulatorOptions::Check() const {
  if (!(noise.rate_hz > 0)) throw ConfigError("IMU rate_hz: expected a positive number");
  const double least = std::min({noise.gyro_noise_rad_s_sqrthz, noise.gyro_walk_rad_s2_sqrthz,
                                 noise.accel_noise_m_s2_sqrthz, noise.accel_walk_m_s3_sqrthz});
  if (!(least >= 0)) throw ConfigError("IMU noise: expected densities of zero or more");
}

SimulatedImu SimulateImu(const MotionSpline& motion, const ImuSimulatorOptions& options,
                         const Progress& progress) {
  options.Check();
  const double scale = options.with_noise ? 1.0 : 0.0;
  const double root_rate = std::sqrt(options.noise.rate_hz);
  NormalVectors normal(options.seed);
  ImuBias bias{options.initial_gyro_bias_rad_s, options.initial_accel_bias_m_s2};
  SimulatedImu imu;
  const auto count = static_cast<int64_t>(motion.Duration() * options.noise.rate_hz + 1e-6) + 1;
  if (count > kMaxSamples) {
    throw ConfigError(
        fmt::format("IMU: found {} samples to simulate, expected at most {}: simulate "
                    "a shorter time, or a lower rate",
                    count, kMaxSamples));
  }
  for (int64_t i = 0; i < count; ++i) {
    if (i % 1024 == 0) progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(count));
    const double t_s = static_cast<double>(i) / options.noise.rate_hz;
    ImuSample sample = ExactSample(motion, t_s);
    sample.stamp_ns = options.start_stamp_ns + ToNanoseconds(t_s);
    sample.angular_velocity_rad_s +=
        bias.gyro_rad_s + normal.Draw(scale * options.noise.gyro_noise_rad_s_sqrthz * root_rate);
    sample.specific_force_m_s2 +=
        bias.accel_m_s2 + normal.Draw(scale * options.noise.accel_noise_m_s2_sqrthz * root_rate);
    imu.samples.push_back(sample);
    imu.biases.push_back(bias);
    bias.gyro_rad_s += normal.Draw(scale * options.noise.gyro_walk_rad_s2_sqrthz / root_rate);
    bias.accel_m_s2 += normal.Draw(scale * options.noise.accel_walk_m_s3_sqrthz / root_rate);
  }
  return imu;
}

}  // namespace slcmap::data
