#include "mapping/given_poses/pose_adjustment.h"

#include <ceres/autodiff_cost_function.h>
#include <ceres/iteration_callback.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/rotation.h>
#include <ceres/solver.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>

#include "data/error.h"
#include "odometry/geometry/pinhole.h"

namespace slcmap {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// What a pose is moved by, in its own frame: a rotation vector, then a translation.
using Move = std::array<double, 6>;

template <typename T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

// How far a moved pose is from the given one.
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

// How far a point is from where it was found.
struct MatchTerm {
  Vector3d p_imu_from;  // the point, in the given frame of the view that it is of
  RigidTransform T_to_from;
  RigidTransform T_camera_imu;
  Camera camera;
  Vector2d px;
  Matrix2d weight;  // root of the information

  template <typename T>
  bool operator()(const T* from, const T* to, T* residual) const {
    const Vector3<T> p = p_imu_from.cast<T>();
    Vector3<T> moved;
    ceres::AngleAxisRotatePoint(from, p.data(), moved.data());
    moved += Eigen::Map<const Vector3<T>>(from + 3);
    const Vector3<T> in_given = T_to_from.rotation.cast<T>() * moved +
                                T_to_from.translation.cast<T>() -
                                Eigen::Map<const Vector3<T>>(to + 3);
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

MatchTerm TermOf(const PoseMatch& match, const Views& given, const Views& start, const Rig& rig,
                 const GivenPoseOptions& options) {
  const RigidTransform T_to_from =
      given[match.to].T_world_imu.Inverse() * given[match.from].T_world_imu;
  return {rig.T_imu_camera[0] * match.p_from,
          T_to_from,
          rig.T_imu_camera[0].Inverse(),
          rig.cameras[0],
          match.px,
          WeightOf(match, start, rig, options.point_sigma_px)};
}

Move MoveBetween(const RigidTransform& given, const RigidTransform& moved) {
  const RigidTransform move = given.Inverse() * moved;
  const Eigen::AngleAxisd turn(move.rotation);
  const Vector3d vector = turn.angle() * turn.axis();
  const Vector3d& way = move.translation;
  return {vector.x(), vector.y(), vector.z(), way.x(), way.y(), way.z()};
}

RigidTransform Moved(const RigidTransform& given, const Move& move) {
  const Vector3d vector(move[0], move[1], move[2]);
  const double angle = vector.norm();
  const Eigen::Quaterniond turn(
      Eigen::AngleAxisd(angle, angle > 0 ? Vector3d(vector / angle) : Vector3d::UnitX()));
  return given * RigidTransform(turn, {move[3], move[4], move[5]});
}

class StopWhenAsked final : public ceres::IterationCallback {
 public:
  StopWhenAsked(const Progress& progress, int iterations)
      : progress_(progress), iterations_(iterations) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    stopped_ = !progress_.Report(std::min(1.0, 1.0 * summary.iteration / iterations_));
    return stopped_ ? ceres::SOLVER_ABORT : ceres::SOLVER_CONTINUE;
  }
  bool stopped() const { return stopped_; }

 private:
  const Progress& progress_;
  int iterations_;
  bool stopped_ = false;
};

// False where the solution cannot be used.
bool Solve(ceres::Problem* problem, const GivenPoseOptions& options, const Progress& progress) {
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  solver.num_threads = 1;  // sums of several threads come in any order
  solver.max_num_iterations = options.max_iterations;
  solver.logging_type = ceres::SILENT;
  StopWhenAsked callback(progress, options.max_iterations);
  solver.callbacks = {&callback};
  ceres::Solver::Summary summary;
  ceres::Solve(solver, problem, &summary);
  if (callback.stopped()) throw StoppedError("interrupted");
  return summary.IsSolutionUsable();
}

}  // namespace

Views AdjustViews(const Views& given, const Views& start, const std::vector<PoseMatch>& matches,
                  const Rig& rig, const GivenPoseOptions& options, const Progress& progress) {
  std::vector<Move> moves;
  for (size_t i = 0; i < given.size(); ++i) {
    moves.push_back(MoveBetween(given[i].T_world_imu, start[i].T_world_imu));
  }
  ceres::Problem::Options owner;
  owner.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::CauchyLoss loss(options.robust_sigmas);
  ceres::Problem problem(owner);
  for (Move& move : moves) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PriorTerm, 6, 6>(
                                 new PriorTerm{options.sigma_rad, options.sigma_m}),
                             nullptr, move.data());
  }
  for (const PoseMatch& match : matches) {
    auto* term = new MatchTerm(TermOf(match, given, start, rig, options));
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<MatchTerm, 2, 6, 6>(term), &loss,
                             moves[match.from].data(), moves[match.to].data());
  }
  if (!Solve(&problem, options, progress)) return start;
  Views adjusted = given;
  for (size_t i = 0; i < given.size(); ++i) {
    adjusted[i].T_world_imu = Moved(given[i].T_world_imu, moves[i]);
  }
  return adjusted;
}

}  // namespace slcmap
