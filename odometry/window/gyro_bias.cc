#include "odometry/window/gyro_bias.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace slcmap {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kBiasIterations = 8;
constexpr size_t kMinPairPoints = 12;
constexpr double kNoise_rad = 1e-3;        // of a ray: where a point begins to weigh less
constexpr double kPriorSigma_rad_s = 0.1;  // of the bias

// Rays of the same points in two frames, in the IMU's axes, and the gyroscope between them.
struct FramePair {
  std::vector<Vector3d> first, second;
  Preintegration imu;
  Vector3d travel = Vector3d::Zero();  // direction, in the first frame's axes
};

Vector3d RayOf(const StereoMeasurement& measurement, const StereoGeometry& geometry) {
  return (geometry.R_imu_camera[0] * geometry.OnTruePlane(0, measurement.left).homogeneous())
      .normalized();
}

std::vector<FramePair> PairsOf(const std::vector<std::unique_ptr<FrameState>>& frames,
                               const StereoGeometry& geometry, const ImuNoise& noise,
                               double apart_s) {
  std::vector<FramePair> pairs;
  for (size_t i = 0; i < frames.size(); ++i) {
    FramePair pair{{}, {}, Preintegration(noise, Vector3d::Zero(), Vector3d::Zero())};
    size_t j = i;
    while (pair.imu.duration_s() < apart_s && ++j < frames.size()) {
      const auto& samples = frames[j]->from_previous->samples();
      for (size_t k = j == i + 1 ? 0 : 1; k < samples.size(); ++k) pair.imu.Append(samples[k]);
    }
    if (j >= frames.size()) break;
    for (const auto& [id, measurement] : frames[i]->measurements) {
      const auto later = frames[j]->measurements.find(id);
      if (later == frames[j]->measurements.end()) continue;
      pair.first.push_back(RayOf(measurement, geometry));
      pair.second.push_back(RayOf(later->second, geometry));
    }
    if (pair.first.size() >= kMinPairPoints) pairs.push_back(std::move(pair));
  }
  return pairs;
}

struct BiasNormal {
  Matrix3d h = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
};

// The direction that fits best at this rotation.
void FindTravel(const Matrix3d& R, FramePair* pair) {
  Matrix3d normals = Matrix3d::Zero();
  for (size_t k = 0; k < pair->first.size(); ++k) {
    const Vector3d n = pair->first[k].cross(R * pair->second[k]);
    normals += n * n.transpose() / (1 + n.squaredNorm() / (kNoise_rad * kNoise_rad));
  }
  pair->travel = Eigen::SelfAdjointEigenSolver<Matrix3d>(normals).eigenvectors().col(0);
}

// Normal equations of one pair with (bias, travel); the travel is eliminated.
void AddPair(const Vector3d& bias, FramePair* pair, BiasNormal* out) {
  const Matrix3d R = pair->imu.CorrectedFor(bias, Vector3d::Zero()).rotation.toRotationMatrix();
  const Matrix3d by_bias = pair->imu.jacobian().block<3, 3>(kRowRotation, kRowGyroBias);
  FindTravel(R, pair);
  const Vector3d& t = pair->travel;
  Eigen::Matrix<double, 3, 2> across;
  across << t.unitOrthogonal(), t.cross(t.unitOrthogonal());
  Eigen::Matrix<double, 5, 5> h = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 5, 1> b = Eigen::Matrix<double, 5, 1>::Zero();
  for (size_t k = 0; k < pair->first.size(); ++k) {
    const Vector3d& first = pair->first[k];
    const Vector3d turned = R * pair->second[k];
    const Vector3d n = first.cross(turned);
    // By the error of a ray: near the direction of travel itself it tells little.
    const double scale = 1 / (kNoise_rad * std::max(0.1, t.cross(first).norm()));
    const double residual = scale * t.dot(n);
    Eigen::Matrix<double, 5, 1> j;
    j.head<3>() =
        scale * (by_bias.transpose() * pair->second[k].cross(R.transpose() * t.cross(first)));
    j.tail<2>() = scale * (across.transpose() * n);
    const double weight = 1 / (1 + residual * residual);
    h += weight * j * j.transpose();
    b -= weight * j * residual;
  }
  h.bottomRightCorner<2, 2>().diagonal().array() += 1e-3;
  const Eigen::Matrix<double, 3, 2> gain =
      h.bottomRightCorner<2, 2>().ldlt().solve(h.bottomLeftCorner<2, 3>()).transpose();
  out->h += h.topLeftCorner<3, 3>() - gain * h.bottomLeftCorner<2, 3>();
  out->b += b.head<3>() - gain * b.tail<2>();
}

}  // namespace

std::optional<Vector3d> GyroBiasFromImages(const std::vector<std::unique_ptr<FrameState>>& frames,
                                           const StereoGeometry& geometry, const ImuNoise& noise,
                                           double apart_s) {
  std::vector<FramePair> pairs = PairsOf(frames, geometry, noise, apart_s);
  if (pairs.empty()) return std::nullopt;
  Vector3d bias = Vector3d::Zero();
  for (int i = 0; i < kBiasIterations; ++i) {
    BiasNormal all;
    const double prior = 1 / (kPriorSigma_rad_s * kPriorSigma_rad_s);
    all.h.diagonal().array() += prior;
    all.b -= prior * bias;
    for (FramePair& pair : pairs) AddPair(bias, &pair, &all);
    bias += all.h.ldlt().solve(all.b);
  }
  if (!(bias.norm() < 3 * kPriorSigma_rad_s)) return std::nullopt;
  return bias;
}

}  // namespace slcmap
