#include "data/check/turn_alignment.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "data/asl_files.h"
#include "data/check/gyro_integral.h"
#include "data/rigid_transform.h"

namespace slcmap {
namespace {

constexpr double kOffsetStep_s = 0.005;
constexpr size_t kMinTurns = 30;
constexpr double kTurnFloor_rad = 2e-4;  // of a turn's deviation, for what its residuals hide
constexpr double kMinRate_rad_s = 0.02;  // RMS about the mean, to tell anything
constexpr double kMaxShownNoise = 0.5;   // of the turn rate's variance
constexpr int kWeightRounds = 4, kIterations = 8;
constexpr double kBiasSigma_rad_s = 0.2;
constexpr double kUsualScaleError = 0.05;

// Turn rates of camera and gyroscope over the same steps, at one time offset.
struct Rates {
  std::vector<Eigen::Vector3d> camera, gyro;
  std::vector<double> weights;
};

// Second moments about the means.
struct Moments {
  Eigen::Matrix3d gyro_gyro = Eigen::Matrix3d::Zero(), gyro_camera = Eigen::Matrix3d::Zero();
  double camera = 0;  // variance
};

Moments MomentsOf(const Rates& rates) {
  Eigen::Vector3d mean_camera = Eigen::Vector3d::Zero(), mean_gyro = Eigen::Vector3d::Zero();
  double total = 0;
  for (size_t i = 0; i < rates.weights.size(); ++i) {
    mean_camera += rates.weights[i] * rates.camera[i];
    mean_gyro += rates.weights[i] * rates.gyro[i];
    total += rates.weights[i];
  }
  mean_camera /= total;
  mean_gyro /= total;
  Moments moments;
  for (size_t i = 0; i < rates.weights.size(); ++i) {
    const Eigen::Vector3d camera = rates.camera[i] - mean_camera, gyro = rates.gyro[i] - mean_gyro;
    const double weight = rates.weights[i] / total;
    moments.gyro_gyro += weight * gyro * gyro.transpose();
    moments.gyro_camera += weight * gyro * camera.transpose();
    moments.camera += weight * camera.squaredNorm();
  }
  return moments;
}

// The linear map from gyroscope to camera that leaves least.
Eigen::Matrix3d BestMap(const Moments& moments) {
  Eigen::Matrix3d damped = moments.gyro_gyro;
  damped.diagonal().array() += 1e-6 * damped.trace() + 1e-15;
  return damped.ldlt().solve(moments.gyro_camera).transpose();
}

// Share of the camera's variance that `map` leaves.
double Unexplained(const Moments& moments, const Eigen::Matrix3d& map) {
  const double left = moments.camera - 2 * (map * moments.gyro_camera).trace() +
                      (map * moments.gyro_gyro * map.transpose()).trace();
  return std::max(0.0, left) / std::max(moments.camera, 1e-12);
}

double BestScale(const Moments& moments, const Eigen::Matrix3d& map) {
  const double size = (map * moments.gyro_gyro * map.transpose()).trace();
  return size <= 0 ? 1 : (map * moments.gyro_camera).trace() / size;
}

class Aligner {
 public:
  Aligner(const std::vector<ImageTurn>& turns, const std::vector<ImuSample>& imu,
          const Eigen::Quaterniond& R_imu_camera, double time_offset_s)
      : gyro_(imu), R_imu_camera_(R_imu_camera), claimed_s_(time_offset_s) {
    const int64_t furthest_ns = ToNanoseconds(kMaxAlignedOffset_s);
    const int64_t claimed_ns = ToNanoseconds(time_offset_s);
    for (const ImageTurn& turn : turns) {
      if (!gyro_.Covers(turn.from_ns + claimed_ns - furthest_ns,
                        turn.to_ns + claimed_ns + furthest_ns)) {
        continue;
      }
      turns_.push_back(turn);
      Eigen::Matrix3d covariance = turn.covariance;
      covariance.diagonal().array() += kTurnFloor_rad * kTurnFloor_rad;
      const double step_s = ToSeconds(turn.to_ns - turn.from_ns);
      covariances_.push_back(covariance);
      weights_.push_back(step_s * step_s / covariance.trace());
    }
  }

  TurnAlignment Align() {
    TurnAlignment alignment;
    if (turns_.size() < kMinTurns) return alignment;
    WeighDown();
    Compare(&alignment);
    const double noise = NoiseVariance();
    alignment.enough_motion =
        alignment.turn_rate_rad_s > kMinRate_rad_s &&
        noise < kMaxShownNoise * alignment.turn_rate_rad_s * alignment.turn_rate_rad_s;
    if (alignment.enough_motion) Refine(&alignment);
    return alignment;
  }

 private:
  Rates RatesAt(double time_offset_s) const {
    Rates rates;
    const int64_t offset_ns = ToNanoseconds(time_offset_s);
    for (const ImageTurn& turn : turns_) {
      const double step_s = ToSeconds(turn.to_ns - turn.from_ns);
      rates.camera.push_back(turn.turn_rad / step_s);
      rates.gyro.push_back(gyro_.Between(turn.from_ns + offset_ns, turn.to_ns + offset_ns) /
                           step_s);
    }
    rates.weights = weights_;
    return rates;
  }

  template <typename Visit>
  void ForEachOffset(Visit visit) const {
    const int steps = static_cast<int>(std::lround(kMaxAlignedOffset_s / kOffsetStep_s));
    for (int step = -steps; step <= steps; ++step) {
      const double offset_s = claimed_s_ + step * kOffsetStep_s;
      visit(offset_s, RatesAt(offset_s));
    }
  }

  double BestOffsetOfAnyMap() const {
    double best_s = claimed_s_, least = 2;
    ForEachOffset([&](double offset_s, const Rates& rates) {
      const Moments moments = MomentsOf(rates);
      const double unexplained = Unexplained(moments, BestMap(moments));
      if (unexplained >= least) return;
      least = unexplained;
      best_s = offset_s;
    });
    return best_s;
  }

  // Turns that no linear map explains count less: features followed wrongly.
  void WeighDown() {
    const std::vector<double> weights = weights_;
    for (int round = 0; round < kWeightRounds; ++round) {
      const Rates rates = RatesAt(BestOffsetOfAnyMap());
      const Eigen::Matrix3d map = BestMap(MomentsOf(rates));
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      double total = 0;
      for (size_t i = 0; i < weights_.size(); ++i) {
        mean += weights_[i] * (rates.camera[i] - map * rates.gyro[i]);
        total += weights_[i];
      }
      mean /= total;
      std::vector<double> residuals;
      for (size_t i = 0; i < weights_.size(); ++i) {
        residuals.push_back((rates.camera[i] - map * rates.gyro[i] - mean).norm() *
                            std::sqrt(weights[i]));
      }
      const double scale = 2 * Median(residuals) + 1e-12;
      for (size_t i = 0; i < weights_.size(); ++i) {
        weights_[i] = weights[i] / (1 + std::pow(residuals[i] / scale, 2));
      }
    }
  }

  // What the images' own noise adds to the variance of their turn rate.
  double NoiseVariance() const {
    double sum = 0, total = 0;
    for (size_t i = 0; i < turns_.size(); ++i) {
      const double step_s = ToSeconds(turns_[i].to_ns - turns_[i].from_ns);
      sum += weights_[i] * covariances_[i].trace() / (step_s * step_s);
      total += weights_[i];
    }
    return sum / total;
  }

  std::vector<AxisChange> Candidates() const {
    std::vector<AxisChange> changes = AxisChanges();
    const Eigen::Matrix3d R = R_imu_camera_.toRotationMatrix();
    changes.insert(changes.begin() + 1, {R * R, "inverted"});
    return changes;
  }

  void Compare(TurnAlignment* alignment) const {
    const Eigen::Matrix3d R_camera_imu = R_imu_camera_.conjugate().toRotationMatrix();
    const std::vector<AxisChange> changes = Candidates();
    alignment->claimed.unexplained = alignment->best.unexplained = 1e9;
    ForEachOffset([&](double offset_s, const Rates& rates) {
      const Moments moments = MomentsOf(rates);
      alignment->turn_rate_rad_s = std::sqrt(moments.camera);
      alignment->unexplained =
          std::min(alignment->unexplained, Unexplained(moments, BestMap(moments)));
      for (const AxisChange& change : changes) {
        const Eigen::Matrix3d map = R_camera_imu * change.matrix;
        Improve({change, 1, offset_s, Unexplained(moments, map)}, alignment);
        const double scale = BestScale(moments, map);
        if (scale <= 0) continue;
        const TurnFit scaled = {change, scale, offset_s, Unexplained(moments, scale * map)};
        if (scaled.unexplained < alignment->best.unexplained) alignment->best = scaled;
      }
    });
  }

  static void Improve(const TurnFit& fit, TurnAlignment* alignment) {
    if (fit.change.IsNone() && fit.unexplained < alignment->claimed.unexplained) {
      alignment->claimed = fit;
    }
    if (fit.unexplained < alignment->best.unexplained) alignment->best = fit;
  }

  // Gauss-Newton over offset, rotation (on the camera's side), bias and the scales of the camera's
  // axes; robust.
  void Refine(TurnAlignment* alignment) const {
    using Vector10d = Eigen::Matrix<double, 10, 1>;
    using Matrix10d = Eigen::Matrix<double, 10, 10>;
    const TurnFit& fit = alignment->best;
    Eigen::Matrix3d map =
        R_imu_camera_.conjugate().toRotationMatrix() * fit.change.matrix;  // to the camera
    double offset_s = fit.time_offset_s;
    Eigen::Vector3d bias = Eigen::Vector3d::Zero();  // in the camera, of the scaled rates
    Eigen::Vector3d scales = Eigen::Vector3d::Constant(fit.scale);
    Matrix10d H;
    double squares = 0, count = 0;
    for (int iteration = 0; iteration < kIterations; ++iteration) {
      H.setZero();
      Vector10d g = Vector10d::Zero();
      squares = count = 0;
      const int64_t offset_ns = ToNanoseconds(offset_s);
      for (size_t i = 0; i < turns_.size(); ++i) {
        const ImageTurn& turn = turns_[i];
        const int64_t from_ns = turn.from_ns + offset_ns, to_ns = turn.to_ns + offset_ns;
        if (!gyro_.Covers(from_ns, to_ns)) continue;
        const double step_s = ToSeconds(turn.to_ns - turn.from_ns);
        const Eigen::Vector3d turned = map * gyro_.Between(from_ns, to_ns);
        const Eigen::Vector3d e = turn.turn_rad - scales.cwiseProduct(turned) - bias * step_s;
        Eigen::Matrix<double, 3, 10> J;  // of what is predicted
        J.col(0) = scales.cwiseProduct(map * (gyro_.RateAt(to_ns) - gyro_.RateAt(from_ns)));
        J.middleCols<3>(1) = -(scales.asDiagonal() * Skew(turned));  // Exp(d) map
        J.middleCols<3>(4) = step_s * Eigen::Matrix3d::Identity();
        J.middleCols<3>(7) = turned.asDiagonal();
        const Eigen::Matrix3d information = covariances_[i].inverse();
        const double square = e.dot(information * e);
        const double weight = 1 / (1 + square / 12);
        H += weight * J.transpose() * information * J;
        g += weight * J.transpose() * information * e;
        squares += weight * square;
        count += weight;
      }
      for (int k = 4; k < 7; ++k) {
        H(k, k) += std::pow(kBiasSigma_rad_s, -2);
        g[k] -= bias[k - 4] * std::pow(kBiasSigma_rad_s, -2);
      }
      H.diagonal().array() += 1e-9;
      const Vector10d step = H.ldlt().solve(g);
      if (!step.allFinite()) {
        alignment->enough_motion = false;
        return;
      }
      offset_s += std::clamp(step[0], -0.02, 0.02);
      map = ExpRotation(step.segment<3>(1)).toRotationMatrix() * map;
      bias += step.segment<3>(4);
      scales += step.tail<3>();
    }
    const Matrix10d covariance =
        H.inverse() * std::max(1.0, squares / std::max(3 * count - 10, 1.0));
    if (!covariance.allFinite() || !(covariance.diagonal().minCoeff() >= 0)) {
      alignment->enough_motion = false;
      return;
    }
    alignment->time_offset_s = offset_s;
    alignment->time_offset_sigma_s = std::sqrt(covariance(0, 0));
    // map = R_camera_imu, times the change where that is no rotation.
    const Eigen::Matrix3d rotation =
        fit.change.IsRotation() ? map : Eigen::Matrix3d(map * fit.change.matrix.transpose());
    alignment->R_imu_camera = Eigen::Quaterniond(Eigen::Matrix3d(rotation.transpose()));
    alignment->rotation_sigma_rad =
        (rotation.transpose() * covariance.block<3, 3>(1, 1) * rotation).diagonal().cwiseSqrt();
    // Scales that differ between the axes are the images', not the gyroscope's.
    const double scale = std::abs(fit.scale - 1) < kUsualScaleError ? 1 : fit.scale;
    alignment->camera_from_gyro = scale * map;
    alignment->camera_bias_rad_s = -scale * bias.cwiseQuotient(scales);
    alignment->scales = scales;
    alignment->scale_sigmas = covariance.diagonal().tail<3>().cwiseSqrt();
  }

  const GyroIntegral gyro_;
  const Eigen::Quaterniond R_imu_camera_;
  const double claimed_s_;
  std::vector<ImageTurn> turns_;
  std::vector<Eigen::Matrix3d> covariances_;
  std::vector<double> weights_;
};

}  // namespace

TurnAlignment AlignTurns(const std::vector<ImageTurn>& turns, const std::vector<ImuSample>& imu,
                         const Eigen::Quaterniond& R_imu_camera, double time_offset_s) {
  return Aligner(turns, imu, R_imu_camera, time_offset_s).Align();
}

}  // namespace slcmap
