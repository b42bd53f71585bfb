#include "mapping/given_poses/pose_adjustment.h"

#include <ceres/autodiff_cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/rotation.h>
#include <ceres/solver.h>

#include <Eigen/Cholesky>

#include "data/error.h"
#include "data/rigid_transform.h"
#include "mapping/adjustment/solver_progress.h"

namespace slcmap {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

template <typename T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

// How much is corrected, in standard deviations.
struct PriorTerm {
  double sigma_rad, sigma_m;

  template <typename T>
  bool operator()(const T* move, T* residual) const {
    for (int i = 0; i < 3; ++i) {
      residual[i] = move[i] / sigma_rad;
      residual[3 + i] = move[3 + i] / sigma_m;
    }
    return true;
  }
};

struct ClockTerm {
  double sigma_s;

  template <typename T>
  bool operator()(const T* clock_s, T* residual) const {
    residual[0] = clock_s[0] / sigma_s;
    return true;
  }
};

template <typename T>
std::array<T, 6> Sum(const T* common, const T& clock_s, const PoseMove& speed, const T* own) {
  std::array<T, 6> sum;
  for (int i = 0; i < 6; ++i) sum[i] = common[i] + clock_s * speed[i] + own[i];
  return sum;
}

// How far a point is from where it was found.
struct MatchTerm {
  Vector3d p_imu_from;  // the point, in the frame of the body where the view is of
  PoseMove speed_from, speed_to;
  RigidTransform T_to_from;
  RigidTransform T_camera_imu;
  Camera camera;
  Vector2d px;
  Matrix2d weight;  // root of the information

  template <typename T>
  bool operator()(const T* common, const T* clock_s, const T* own_from, const T* own_to,
                  T* residual) const {
    const std::array<T, 6> from = Sum(common, *clock_s, speed_from, own_from);
    const std::array<T, 6> to = Sum(common, *clock_s, speed_to, own_to);
    const Vector3<T> p = p_imu_from.cast<T>();
    Vector3<T> moved;
    ceres::AngleAxisRotatePoint(from.data(), p.data(), moved.data());
    moved += Eigen::Map<const Vector3<T>>(from.data() + 3);
    const Vector3<T> in_given = T_to_from.rotation.cast<T>() * moved +
                                T_to_from.translation.cast<T>() -
                                Eigen::Map<const Vector3<T>>(to.data() + 3);
    const T back[3] = {-to[0], -to[1], -to[2]};
    Vector3<T> in_imu;
    ceres::AngleAxisRotatePoint(back, in_given.data(), in_imu.data());
    const Vector3<T> q =
        T_camera_imu.rotation.cast<T>() * in_imu + T_camera_imu.translation.cast<T>();
    if (q.z() < T(1e-3)) return false;
    Eigen::Map<Eigen::Matrix<T, 2, 1>> out(residual);
    out << q.x() / q.z() * camera.fx_px + camera.cx_px - px.x(),
        q.y() / q.z() * camera.fy_px + camera.cy_px - px.y();
    out = (weight.cast<T>() * out).eval();
    return true;
  }
};

// The error of a point's depth moves it along the epipolar line.
Matrix2d WeightOf(const PoseMatch& match, const Views& views, const Rig& rig, double sigma_px) {
  PoseMatch nearer = match;
  const double inverse_depth = 1 / match.p_from.z() + match.inverse_depth_sigma;
  nearer.p_from = match.p_from / (match.p_from.z() * inverse_depth);
  const auto here = OffMatch_px(match, views, rig), there = OffMatch_px(nearer, views, rig);
  const Vector2d along = here && there ? Vector2d(*there - *here) : Vector2d::Zero();
  const Matrix2d covariance =
      sigma_px * sigma_px * Matrix2d::Identity() + along * along.transpose();
  return covariance.inverse().llt().matrixU();
}

MatchTerm TermOf(const PoseMatch& match, const GivenViews& given, const Views& corrected,
                 const Rig& rig, const GivenPoseOptions& options) {
  const RigidTransform T_to_from =
      given.views[match.to].T_world_imu.Inverse() * given.views[match.from].T_world_imu;
  return {rig.T_imu_camera[0] * match.p_from,
          given.speeds[match.from],
          given.speeds[match.to],
          T_to_from,
          rig.T_imu_camera[0].Inverse(),
          rig.cameras[0],
          match.px,
          WeightOf(match, corrected, rig, options.point_sigma_px)};
}

ceres::CostFunction* PriorOf(double sigma_rad, double sigma_m) {
  return new ceres::AutoDiffCostFunction<PriorTerm, 6, 6>(new PriorTerm{sigma_rad, sigma_m});
}

// False where the solution cannot be used.
bool Solve(ceres::Problem* problem, const GivenPoseOptions& options, const Progress& progress) {
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  solver.num_threads = 1;  // sums of several threads come in any order
  solver.max_num_iterations = options.max_iterations;
  solver.logging_type = ceres::SILENT;
  SolverProgress callback(progress, options.max_iterations);
  solver.callbacks = {&callback};
  ceres::Solver::Summary summary;
  ceres::Solve(solver, problem, &summary);
  if (callback.stopped()) throw StoppedError("interrupted");
  return summary.IsSolutionUsable();
}

}  // namespace

RigidTransform CorrectedPose(const RigidTransform& given, const PoseCorrection& correction,
                             const PoseMove& speed, const PoseMove& own) {
  const PoseMove move = Sum(correction.common.data(), correction.clock_s, speed, own.data());
  return given *
         RigidTransform(ExpRotation({move[0], move[1], move[2]}), {move[3], move[4], move[5]});
}

Views Corrected(const GivenViews& given, const PoseCorrection& correction) {
  Views corrected = given.views;
  for (size_t i = 0; i < corrected.size(); ++i) {
    corrected[i].T_world_imu =
        CorrectedPose(given.views[i].T_world_imu, correction, given.speeds[i], correction.own[i]);
  }
  return corrected;
}

std::optional<PoseCorrection> AdjustPoses(const GivenViews& given, const PoseCorrection& start,
                                          const std::vector<PoseMatch>& matches, const Rig& rig,
                                          const GivenPoseOptions& options,
                                          const Progress& progress) {
  PoseCorrection found = start;
  const Views corrected = Corrected(given, start);
  ceres::Problem::Options owner;
  owner.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::CauchyLoss loss(options.robust_sigmas);
  ceres::Problem problem(owner);
  problem.AddResidualBlock(PriorOf(options.body_sigma_rad, options.body_sigma_m), nullptr,
                           found.common.data());
  problem.AddResidualBlock(
      new ceres::AutoDiffCostFunction<ClockTerm, 1, 1>(new ClockTerm{options.clock_sigma_s}),
      nullptr, &found.clock_s);
  for (PoseMove& own : found.own) {
    problem.AddResidualBlock(PriorOf(options.sigma_rad, options.sigma_m), nullptr, own.data());
  }
  for (const PoseMatch& match : matches) {
    auto* term = new MatchTerm(TermOf(match, given, corrected, rig, options));
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<MatchTerm, 2, 6, 1, 6, 6>(term), &loss,
                             found.common.data(), &found.clock_s, found.own[match.from].data(),
                             found.own[match.to].data());
  }
  if (!Solve(&problem, options, progress)) return std::nullopt;
  return found;
}

}  // namespace slcmap
