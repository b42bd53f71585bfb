#include "data/check/force_alignment.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>

#include "data/check/view_geometry.h"
#include "data/core/types.h"
#include "data/source/asl_files.h"

namespace slcmap::inline data {
namespace {

constexpr size_t kMinMeasurements = 12;
constexpr double kMaxMisfit_m_s2 = 3;   // a larger one counts as this
constexpr double kMaxStep_m = 2;        // in one step
constexpr double kMaxNoise_rad = 3e-3;  // of a step's rays
constexpr int kRounds = 6;
// To tell one change of axes from another.
constexpr double kMinMisfit_m_s2 = 0.15, kMuchBetter = 0.5;
constexpr double kMinShare = 0.05;  // of the baseline's claimed length that forces may show

// The mean acceleration over two steps, in the frame of the camera at the start of its part:
//   image = force * vec(R_camera_imu * change) + lever * l_camera + gravity.
struct Measurement {
  int part = 0;
  Eigen::Vector3d image_m_s2 = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 3, 9> force = Eigen::Matrix<double, 3, 9>::Zero();
  Eigen::Matrix3d lever = Eigen::Matrix3d::Zero();  // 1 / s^2
};

// How the camera turns within a part, with the readings on the way.
struct ForceReading {
  double time_s = 0;  // from the part's start
  Eigen::Matrix3d R_part_camera = Eigen::Matrix3d::Identity();
  Eigen::Vector3d force_m_s2 = Eigen::Vector3d::Zero();
};

class Part {
 public:
  Part(int64_t from_ns, int64_t to_ns, const std::vector<ImuSample>& imu,
       const TurnAlignment& turns) {
    const int64_t offset_ns = ToNanoseconds(turns.time_offset_s);
    auto sample =
        std::lower_bound(imu.begin(), imu.end(), from_ns + offset_ns,
                         [](const ImuSample& s, int64_t t_ns) { return s.stamp_ns < t_ns; });
    Eigen::Quaterniond R = Eigen::Quaterniond::Identity();
    double last_s = 0;
    for (; sample != imu.end() && sample->stamp_ns <= to_ns + offset_ns; ++sample) {
      if (!IsPlausible(*sample)) continue;
      const double time_s = ToSeconds(sample->stamp_ns - offset_ns - from_ns);
      const Eigen::Vector3d rate =
          turns.camera_from_gyro * sample->angular_velocity_rad_s - turns.camera_bias_rad_s;
      R = (R * ExpRotation(rate * (time_s - last_s))).normalized();
      readings_.push_back({time_s, R.toRotationMatrix(), sample->specific_force_m_s2});
      last_s = time_s;
    }
  }

  Eigen::Matrix3d R_part_camera(double time_s) const {
    const auto after = std::lower_bound(
        readings_.begin(), readings_.end(), time_s,
        [](const ForceReading& reading, double t_s) { return reading.time_s < t_s; });
    if (after == readings_.end()) return readings_.back().R_part_camera;
    if (after == readings_.begin()) return after->R_part_camera;
    const auto before = after - 1;
    const double u = (time_s - before->time_s) / (after->time_s - before->time_s);
    return Eigen::Quaterniond(before->R_part_camera)
        .slerp(u, Eigen::Quaterniond(after->R_part_camera))
        .toRotationMatrix();
  }

  // The readings' mean with weights that rise to `middle_s` and fall again: what a change of
  // velocity between two steps is made of.
  Eigen::Matrix<double, 3, 9> MeanForce(double first_s, double middle_s, double last_s) const {
    Eigen::Matrix<double, 3, 9> mean = Eigen::Matrix<double, 3, 9>::Zero();
    double total = 0;
    for (const ForceReading& reading : readings_) {
      if (reading.time_s <= first_s || reading.time_s >= last_s) continue;
      const double weight = reading.time_s < middle_s
                                ? (reading.time_s - first_s) / (middle_s - first_s)
                                : (last_s - reading.time_s) / (last_s - middle_s);
      for (int column = 0; column < 3; ++column) {
        mean.middleCols<3>(3 * column) +=
            weight * reading.force_m_s2[column] * reading.R_part_camera;
      }
      total += weight;
    }
    return total > 0 ? Eigen::Matrix<double, 3, 9>(mean / total) : mean;
  }

  bool empty() const { return readings_.empty(); }

 private:
  std::vector<ForceReading> readings_;
};

// The steps of one part follow each other without a break.
class PartMeasurer {
 public:
  PartMeasurer(const std::vector<StereoStep>& steps, size_t first, size_t end,
               const std::vector<ImuSample>& imu, const TurnAlignment& turns)
      : start_ns_(steps[first].from_ns), part_(start_ns_, steps[end - 1].to_ns, imu, turns) {
    if (part_.empty()) return;
    for (size_t i = first; i < end; ++i) moves_.push_back(ComputeMove(steps[i]));
  }

  void AddTo(int number, std::vector<Measurement>* measurements) const {
    for (size_t i = 1; i < moves_.size(); ++i) {
      const auto &before = moves_[i - 1], &after = moves_[i];
      if (!before || !after) continue;
      const double first_s = before->from_s, middle_s = after->from_s, last_s = after->to_s;
      const double first_step_s = middle_s - first_s, last_step_s = last_s - middle_s;
      const double mean_step_s = 0.5 * (first_step_s + last_step_s);
      Measurement measurement;
      measurement.part = number;
      measurement.image_m_s2 =
          (after->move_m / last_step_s - before->move_m / first_step_s) / mean_step_s;
      measurement.force = part_.MeanForce(first_s, middle_s, last_s);
      const Eigen::Matrix3d R_middle = part_.R_part_camera(middle_s);
      measurement.lever = ((part_.R_part_camera(last_s) - R_middle) / last_step_s -
                           (R_middle - part_.R_part_camera(first_s)) / first_step_s) /
                          mean_step_s;
      measurements->push_back(measurement);
    }
  }

 private:
  struct Move {
    double from_s = 0, to_s = 0;
    Eigen::Vector3d move_m = Eigen::Vector3d::Zero();  // in the part's frame
  };

  std::optional<Move> ComputeMove(const StereoStep& step) const {
    const double from_s = ToSeconds(step.from_ns - start_ns_);
    const double to_s = ToSeconds(step.to_ns - start_ns_);
    const Eigen::Matrix3d R_from = part_.R_part_camera(from_s);
    const Eigen::Quaterniond R(Eigen::Matrix3d(R_from.transpose() * part_.R_part_camera(to_s)));
    const auto seen = SolvePlaced(step.rays, {R, Eigen::Vector3d::Zero()}, true);
    if (!seen || seen->noise_rad > kMaxNoise_rad) return std::nullopt;
    if (seen->T_first_second.translation.norm() > kMaxStep_m) return std::nullopt;
    return Move{from_s, to_s, R_from * seen->T_first_second.translation};
  }

  const int64_t start_ns_;
  const Part part_;
  std::vector<std::optional<Move>> moves_;
};

std::vector<Measurement> Measure(const std::vector<StereoStep>& steps,
                                 const std::vector<ImuSample>& imu, const TurnAlignment& turns) {
  std::vector<Measurement> measurements;
  int parts = 0;
  for (size_t first = 0; first < steps.size();) {
    size_t end = first + 1;
    while (end < steps.size() && steps[end].from_ns == steps[end - 1].to_ns) ++end;
    PartMeasurer(steps, first, end, imu, turns).AddTo(parts++, &measurements);
    first = end;
  }
  return measurements;
}

using Vector9d = Eigen::Matrix<double, 9, 1>;

Vector9d Flat(const Eigen::Matrix3d& matrix) { return Eigen::Map<const Vector9d>(matrix.data()); }

// Residuals less their median in each part, which is gravity; `image` 0 leaves the images out.
std::vector<Eigen::Vector3d> Residuals(const std::vector<Measurement>& measurements,
                                       const Eigen::Matrix3d& camera_from_accel,
                                       const Eigen::Vector3d& lever_camera_m, double image) {
  std::vector<Eigen::Vector3d> residuals;
  for (const Measurement& m : measurements) {
    residuals.push_back(image * (m.image_m_s2 - m.lever * lever_camera_m) -
                        m.force * Flat(camera_from_accel));
  }
  for (size_t first = 0; first < residuals.size();) {
    size_t end = first;
    while (end < residuals.size() && measurements[end].part == measurements[first].part) ++end;
    Eigen::Vector3d gravity;
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> values;
      for (size_t i = first; i < end; ++i) values.push_back(residuals[i][axis]);
      gravity[axis] = Median(values);
    }
    for (size_t i = first; i < end; ++i) residuals[i] -= gravity;
    first = end;
  }
  return residuals;
}

double Misfit(const std::vector<Eigen::Vector3d>& residuals) {
  double sum = 0;
  for (const Eigen::Vector3d& residual : residuals) {
    sum += std::min(residual.norm(), kMaxMisfit_m_s2);
  }
  return sum / static_cast<double>(residuals.size());
}

// What the images' accelerations are made of: the readings' share, the lever's (both over the
// scale) and gravity in each part.
struct Composition {
  Eigen::VectorXd values;  // share, lever in the camera's axes, gravities
  Eigen::MatrixXd covariance;
};

// By least squares, with weights that fall with the residual. The images' noise is on the left
// side, where it does not make the share too small.
Composition Compose(const std::vector<Measurement>& measurements,
                    const Eigen::Matrix3d& camera_from_accel) {
  const int size = 4 + 3 * (measurements.back().part + 1);
  Composition composition{Eigen::VectorXd::Zero(size), {}};
  std::vector<double> norms(measurements.size(), 0);
  for (int round = 0; round < kRounds; ++round) {
    const double scale = round == 0 ? 1 : 2 * Median(norms) + 1e-6;
    Eigen::MatrixXd H = 1e-9 * Eigen::MatrixXd::Identity(size, size);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(size);
    double squares = 0, total = 0;
    std::vector<Eigen::MatrixXd> jacobians;
    for (size_t i = 0; i < measurements.size(); ++i) {
      const Measurement& m = measurements[i];
      Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, size);
      J.col(0) = m.force * Flat(camera_from_accel);
      J.middleCols(1, 3) = m.lever;
      J.middleCols(4 + 3 * m.part, 3) = Eigen::Matrix3d::Identity();
      const double u = norms[i] / scale, weight = 1 / (1 + u * u);
      H += weight * J.transpose() * J;
      g += weight * J.transpose() * m.image_m_s2;
      squares += weight * norms[i] * norms[i];
      total += 3 * weight;
      jacobians.push_back(std::move(J));
    }
    composition.values = H.ldlt().solve(g);
    for (size_t i = 0; i < measurements.size(); ++i) {
      norms[i] = (measurements[i].image_m_s2 - jacobians[i] * composition.values).norm();
    }
    composition.covariance = H.inverse() * std::max(1e-4, squares / std::max(1.0, total - size));
  }
  return composition;
}

}  // namespace

bool IsClearlyBetter(const ForceFit& fit, const ForceFit& than) {
  return than.misfit_m_s2 > kMinMisfit_m_s2 && fit.misfit_m_s2 < kMuchBetter * than.misfit_m_s2;
}

ForceAlignment AlignForces(const std::vector<StereoStep>& steps, const std::vector<ImuSample>& imu,
                           const TurnAlignment& turns, const RigidTransform& T_imu_camera) {
  ForceAlignment alignment;
  if (steps.empty() || !turns.enough_motion) return alignment;
  const std::vector<Measurement> measurements = Measure(steps, imu, turns);
  if (measurements.size() < kMinMeasurements) return alignment;
  const Eigen::Matrix3d R_camera_imu = T_imu_camera.rotation.conjugate().toRotationMatrix();
  const Eigen::Vector3d lever_camera_m = R_camera_imu * T_imu_camera.translation;

  std::vector<AxisChange> changes = AxisChanges();
  changes.push_back(turns.best.change);
  alignment.best.misfit_m_s2 = kMaxMisfit_m_s2;
  for (const AxisChange& change : changes) {
    const Eigen::Matrix3d map = R_camera_imu * change.matrix;
    const ForceFit fit = {change, Misfit(Residuals(measurements, map, lever_camera_m, 1))};
    if (change.IsNone()) alignment.claimed = fit;
    if (fit.misfit_m_s2 < alignment.best.misfit_m_s2) alignment.best = fit;
    alignment.turned = fit;  // the last one
  }
  if (!IsClearlyBetter(alignment.best, alignment.claimed)) alignment.best = alignment.claimed;
  const Composition composition =
      Compose(measurements, R_camera_imu * alignment.best.change.matrix);
  const double share = composition.values[0];
  alignment.enough_motion = share > kMinShare;
  if (!alignment.enough_motion) return alignment;
  alignment.image_scale = 1 / share;
  alignment.image_scale_sigma = std::sqrt(composition.covariance(0, 0)) / (share * share);
  const Eigen::Matrix3d R_imu_camera = turns.R_imu_camera.toRotationMatrix();
  alignment.lever_m = R_imu_camera * composition.values.segment<3>(1) / share;
  // It is over the share, and known no better than that is.
  Eigen::Matrix<double, 3, 4> jacobian;
  jacobian << -alignment.lever_m / share, R_imu_camera / share;
  alignment.lever_sigma_m =
      (jacobian * composition.covariance.topLeftCorner<4, 4>() * jacobian.transpose())
          .diagonal()
          .cwiseSqrt();
  return alignment;
}

}  // namespace slcmap::data
