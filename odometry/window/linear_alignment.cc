#include "odometry/window/linear_alignment.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <map>

namespace slcmap::inline odometry {
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

Vector3d ComputeRay(const StereoMeasurement& measurement, const StereoGeometry& geometry) {
  const int camera = measurement.camera;
  return (geometry.R_imu_camera[camera] *
          geometry.OnTruePlane(camera, measurement.left).homogeneous())
      .normalized();
}

std::vector<FramePair> SelectPairs(const std::vector<std::unique_ptr<FrameState>>& frames,
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
      pair.first.push_back(ComputeRay(measurement, geometry));
      pair.second.push_back(ComputeRay(later->second, geometry));
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
  std::vector<FramePair> pairs = SelectPairs(frames, geometry, noise, apart_s);
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

namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

constexpr int kPasses = 3;
constexpr double kFirstDepth_m = 3;
constexpr double kOutlier_rad = 0.02;  // where an observation's weight begins to fall

// What the IMU alone gives of a frame, relative to the first one.
struct Integrated {
  double t_s = 0;
  Vector3d position_m = Vector3d::Zero();
  Matrix3d rotation = Matrix3d::Identity();
  Vector3d velocity_m_s = Vector3d::Zero();
};

std::vector<Integrated> IntegrateAll(const std::vector<std::unique_ptr<FrameState>>& frames,
                                     const ImuNoise& noise, const Vector3d& gyro_bias_rad_s,
                                     const ImuErrors& errors) {
  Preintegration imu(noise, gyro_bias_rad_s, Vector3d::Zero(), errors);
  std::vector<Integrated> out(1);
  for (size_t i = 1; i < frames.size(); ++i) {
    const auto& samples = frames[i]->from_previous->samples();
    const size_t first = i == 1 ? 0 : 1;  // the intervals share their end samples
    for (size_t k = first; k < samples.size(); ++k) imu.Append(samples[k]);
    const auto motion = imu.CorrectedFor(imu.gyro_bias_rad_s(), imu.accel_bias_m_s2());
    out.push_back({imu.duration_s(), motion.position_m, motion.rotation.toRotationMatrix(),
                   motion.velocity_m_s});
  }
  return out;
}

// One observation: p_camera = rotation (P - v t - g t^2 / 2 - known).
struct Observation {
  Matrix3d rotation;
  Vector3d known;
  double t_s;
  Vector2d measured;

  Eigen::Matrix<double, 2, 3> PointRows() const {
    return rotation.topRows<2>() - measured * rotation.row(2);
  }
};

using ObservationsOfPoint = std::vector<Observation>;

std::vector<ObservationsOfPoint> GatherObservations(
    const std::vector<std::unique_ptr<FrameState>>& frames, const std::vector<Integrated>& imu,
    const StereoGeometry& geometry) {
  std::map<int64_t, ObservationsOfPoint> by_id;
  for (size_t i = 0; i < frames.size(); ++i) {
    for (const auto& [id, measurement] : frames[i]->measurements) {
      for (int c = 0; c < 2; ++c) {
        if (c == 1 && !measurement.right) continue;
        const int camera = measurement.camera + c;
        by_id[id].push_back(
            {(imu[i].rotation * geometry.R_imu_camera[camera]).transpose(),
             imu[i].position_m + imu[i].rotation * geometry.T_imu_camera[camera].translation,
             imu[i].t_s,
             geometry.OnTruePlane(camera, c == 0 ? measurement.left : *measurement.right)});
      }
    }
  }
  std::vector<ObservationsOfPoint> out;
  for (auto& [id, observations] : by_id) {
    if (observations.size() >= 4) out.push_back(std::move(observations));
  }
  return out;
}

// Normal equations of one point with (v, g); the point is eliminated.
struct Normal {
  Matrix3d pp = Matrix3d::Zero();
  Eigen::Matrix<double, 3, 6> px = Eigen::Matrix<double, 3, 6>::Zero();
  Matrix6d xx = Matrix6d::Zero();
  Vector3d bp = Vector3d::Zero();
  Vector6d bx = Vector6d::Zero();
};

Normal ComputeNormal(const ObservationsOfPoint& observations, const std::vector<double>& weights) {
  Normal n;
  for (size_t k = 0; k < observations.size(); ++k) {
    const Observation& s = observations[k];
    const Eigen::Matrix<double, 2, 3> a = weights[k] * s.PointRows();
    Eigen::Matrix<double, 2, 6> x;
    x << -s.t_s * a, -0.5 * s.t_s * s.t_s * a;
    const Vector2d b = a * s.known;
    n.pp += a.transpose() * a;
    n.px += a.transpose() * x;
    n.xx += x.transpose() * x;
    n.bp += a.transpose() * b;
    n.bx += x.transpose() * b;
  }
  n.pp.diagonal().array() += 1e-9;
  return n;
}

struct Solution {
  Vector3d velocity, gravity;
  Matrix6d information;
};

// Solves for v and g, then holds |g| and moves it only along its sphere.
std::optional<Solution> SolveConstrained(const Matrix6d& h, const Vector6d& b, double gravity_m_s2,
                                         double* free_gravity) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(h);
  if (eigen.eigenvalues()[0] < 1e-9 * eigen.eigenvalues()[5]) return std::nullopt;
  const Vector6d x = h.ldlt().solve(b);
  *free_gravity = x.tail<3>().norm();
  Solution solution{x.head<3>(), x.tail<3>().normalized() * gravity_m_s2, h};
  for (int i = 0; i < 5; ++i) {
    const Vector3d up = solution.gravity.normalized();
    Eigen::Matrix<double, 6, 5> basis = Eigen::Matrix<double, 6, 5>::Zero();
    basis.topLeftCorner<3, 3>().setIdentity();
    basis.block<3, 1>(3, 3) = up.unitOrthogonal();
    basis.block<3, 1>(3, 4) = up.cross(up.unitOrthogonal());
    Vector6d fixed = Vector6d::Zero();
    fixed.tail<3>() = solution.gravity;
    const Eigen::Matrix<double, 5, 1> d =
        (basis.transpose() * h * basis).ldlt().solve(basis.transpose() * (b - h * fixed));
    const Vector6d moved = fixed + basis * d;
    solution.velocity = moved.head<3>();
    solution.gravity = moved.tail<3>().normalized() * gravity_m_s2;
  }
  return solution;
}

// New weights of a point's observations: by its inverse depth, and falling for those that do not
// fit.
void Reweight(const ObservationsOfPoint& observations, const Normal& normal,
              const Solution& solution, std::vector<double>* weights) {
  Vector6d x;
  x << solution.velocity, solution.gravity;
  const Vector3d p = normal.pp.ldlt().solve(normal.bp - normal.px * x);
  for (size_t k = 0; k < observations.size(); ++k) {
    const Observation& s = observations[k];
    const Vector3d in_camera = s.rotation * (p - s.t_s * solution.velocity -
                                             0.5 * s.t_s * s.t_s * solution.gravity - s.known);
    const double depth_m = std::max(0.2, in_camera.z());
    const double error_rad = (in_camera.head<2>() / depth_m - s.measured).norm();
    (*weights)[k] = 1.0 / depth_m / (1.0 + error_rad / kOutlier_rad);
  }
}

}  // namespace

std::optional<LinearAlignment> AlignLinearly(const std::vector<std::unique_ptr<FrameState>>& frames,
                                             const StereoGeometry& geometry, const ImuNoise& noise,
                                             const Vector3d& gyro_bias_rad_s,
                                             const ImuErrors& errors, double felt_gravity_m_s2) {
  const std::vector<Integrated> imu = IntegrateAll(frames, noise, gyro_bias_rad_s, errors);
  const std::vector<ObservationsOfPoint> points = GatherObservations(frames, imu, geometry);
  std::vector<std::vector<double>> weights;
  for (const ObservationsOfPoint& point : points)
    weights.emplace_back(point.size(), 1.0 / kFirstDepth_m);
  LinearAlignment out;
  out.points = static_cast<int>(points.size());
  std::optional<Solution> solution;
  for (int pass = 0; pass < kPasses; ++pass) {
    Matrix6d h = Matrix6d::Zero();
    Vector6d b = Vector6d::Zero();
    std::vector<Normal> normals;
    for (size_t j = 0; j < points.size(); ++j) {
      normals.push_back(ComputeNormal(points[j], weights[j]));
      const Normal& n = normals.back();
      const Eigen::Matrix<double, 6, 3> gain = n.pp.ldlt().solve(n.px).transpose();
      h += n.xx - gain * n.px;
      b += n.bx - gain * n.bp;
    }
    solution = SolveConstrained(h, b, felt_gravity_m_s2, &out.free_gravity_m_s2);
    if (!solution) return std::nullopt;
    for (size_t j = 0; j < points.size(); ++j) {
      Reweight(points[j], normals[j], *solution, &weights[j]);
    }
  }
  out.gravity_first_m_s2 = solution->gravity;
  // The lever is as long as it is; what it loses here is far below what the alignment tells.
  const double scale = kGravity_m_s2 / felt_gravity_m_s2;
  for (const Integrated& i : imu) {
    LinearState state;
    state.T_first_imu = {Eigen::Quaterniond(i.rotation),
                         scale * (solution->velocity * i.t_s +
                                  0.5 * i.t_s * i.t_s * solution->gravity + i.position_m)};
    state.velocity_first_m_s =
        scale * (solution->velocity + i.t_s * solution->gravity + i.velocity_m_s);
    out.states.push_back(state);
  }
  return out;
}

}  // namespace slcmap::odometry
