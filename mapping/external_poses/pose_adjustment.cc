#include "mapping/external_poses/pose_adjustment.h"

#include <ceres/autodiff_cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/rotation.h>
#include <ceres/solver.h>
#include <spdlog/spdlog.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdlib>
#include <map>
#include <utility>

#include "data/core/error.h"
#include "data/core/math.h"
#include "data/core/rigid_transform.h"
#include "mapping/adjustment/adjustment_problem.h"
#include "mapping/views/view_matches.h"
#include "odometry/factors/factor.h"

namespace slcmap::inline mapping {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// Poses that images agree with so well stay as they are: the median over pairs of views of how
// far points are, by their median, from where poses have them.
constexpr double kGood_px = 0.3;
// What all poses may be off alike: the body that was tracked against the rig's IMU, and its clock
// against the images'.
constexpr double kBodySigma_m = 0.02;
constexpr double kBodySigma_rad = 0.02;
constexpr double kClockSigma_s = 0.02;
constexpr double kRobustSigmas = 2;  // at which a point counts half (Cauchy)
constexpr int kRounds = 2;           // of looking for points, and adjusting

template <typename T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

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
Matrix2d ComputeWeight(const PoseMatch& match, const Views& views, const Rig& rig,
                       double sigma_px) {
  PoseMatch nearer = match;
  const double inverse_depth = 1 / match.p_from.z() + match.inverse_depth_sigma;
  nearer.p_from = match.p_from / (match.p_from.z() * inverse_depth);
  const auto here = OffMatch_px(match, views, rig), there = OffMatch_px(nearer, views, rig);
  const Vector2d along = here && there ? Vector2d(*there - *here) : Vector2d::Zero();
  const Matrix2d covariance =
      sigma_px * sigma_px * Matrix2d::Identity() + along * along.transpose();
  return covariance.inverse().llt().matrixU();
}

MatchTerm MakeTerm(const PoseMatch& match, const GivenViews& given, const Views& corrected,
                   const Rig& rig, const ExternalPoseOptions& options) {
  const RigidTransform T_to_from =
      given.views[match.to].T_world_imu.Inverse() * given.views[match.from].T_world_imu;
  return {rig.T_imu_camera[0] * match.p_from,
          given.speeds[match.from],
          given.speeds[match.to],
          T_to_from,
          rig.T_imu_camera[0].Inverse(),
          rig.cameras[0],
          match.px,
          ComputeWeight(match, corrected, rig, options.point_sigma_px)};
}

// How much is corrected, in standard deviations.
ceres::CostFunction* MakePrior(double sigma_rad, double sigma_m) {
  constexpr int kSize = std::tuple_size_v<PoseMove>;
  Eigen::VectorXd weights(kSize);
  weights << Vector3d::Constant(1 / sigma_rad), Vector3d::Constant(1 / sigma_m);
  return new AsGivenResidual({kSize, kSize}, weights);
}

// False where the solution cannot be used.
bool Solve(ceres::Problem* problem, const ExternalPoseOptions& options, const Progress& progress) {
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
                                          const ExternalPoseOptions& options,
                                          const Progress& progress) {
  PoseCorrection found = start;
  const Views corrected = Corrected(given, start);
  ceres::Problem::Options owner;
  owner.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::CauchyLoss loss(kRobustSigmas);
  ceres::Problem problem(owner);
  problem.AddResidualBlock(MakePrior(kBodySigma_rad, kBodySigma_m), nullptr, found.common.data());
  problem.AddResidualBlock(
      new AsGivenResidual({1, 1}, Eigen::VectorXd::Constant(1, 1 / kClockSigma_s)), nullptr,
      &found.clock_s);
  for (PoseMove& own : found.own) {
    problem.AddResidualBlock(MakePrior(options.sigma_rad, options.sigma_m), nullptr, own.data());
  }
  for (const PoseMatch& match : matches) {
    auto* term = new MatchTerm(MakeTerm(match, given, corrected, rig, options));
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<MatchTerm, 2, 6, 1, 6, 6>(term), &loss,
                             found.common.data(), &found.clock_s, found.own[match.from].data(),
                             found.own[match.to].data());
  }
  if (!Solve(&problem, options, progress)) return std::nullopt;
  return found;
}

namespace {

// The length of the median of each pair of views.
std::vector<double> OffOfPairs_px(const std::vector<PoseMatch>& matches, const Views& views,
                                  const Rig& rig) {
  std::map<std::pair<size_t, size_t>, std::pair<std::vector<double>, std::vector<double>>> of_pairs;
  for (const PoseMatch& match : matches) {
    const auto off_px = OffMatch_px(match, views, rig);
    if (!off_px) continue;
    auto& [x, y] = of_pairs[{match.from, match.to}];
    x.push_back(off_px->x());
    y.push_back(off_px->y());
  }
  std::vector<double> lengths_px;
  for (auto& [pair, of_pair] : of_pairs) {
    lengths_px.push_back(std::hypot(Quantile(of_pair.first, 0.5), Quantile(of_pair.second, 0.5)));
  }
  return lengths_px;
}

double Turn_rad(const PoseMove& move) { return std::hypot(move[0], move[1], move[2]); }
double Way_m(const PoseMove& move) { return std::hypot(move[3], move[4], move[5]); }

void SetMoves(const PoseCorrection& correction, ExternalPoseFigures* figures) {
  figures->body_turned_rad = Turn_rad(correction.common);
  figures->body_shifted_m = Way_m(correction.common);
  figures->clock_s = correction.clock_s;
  double moved2 = 0, turned2 = 0;
  for (const PoseMove& own : correction.own) {
    moved2 += std::pow(Way_m(own), 2);
    turned2 += std::pow(Turn_rad(own), 2);
  }
  const auto count = static_cast<double>(correction.own.size());
  figures->moved_m = std::sqrt(moved2 / count);
  figures->turned_rad = std::sqrt(turned2 / count);
}

std::nullopt_t NotAdjusted(const char* reason, double off_px) {
  spdlog::warn("poses stay as they were given, {:.2f} px off the images: {}", off_px, reason);
  return std::nullopt;
}

// Of a state, from those before and after it that are near in time; zero where there are none.
PoseMove SpeedAt(const std::vector<OnlineState>& states, size_t at) {
  constexpr int64_t kMost_ns = 250'000'000;
  const OnlineState& here = states[at];
  const auto is_near = [&](const OnlineState& other) {
    return other.segment == here.segment && std::abs(other.stamp_ns - here.stamp_ns) <= kMost_ns;
  };
  const OnlineState& before = at > 0 && is_near(states[at - 1]) ? states[at - 1] : here;
  const OnlineState& after =
      at + 1 < states.size() && is_near(states[at + 1]) ? states[at + 1] : here;
  if (after.stamp_ns <= before.stamp_ns) return {};
  const Eigen::Quaterniond R_here_world = here.T_world_imu.rotation.conjugate();
  const Eigen::AngleAxisd turn(R_here_world * after.T_world_imu.rotation *
                               before.T_world_imu.rotation.conjugate() * here.T_world_imu.rotation);
  const Eigen::Vector3d w = turn.angle() * turn.axis();
  const Eigen::Vector3d way =
      R_here_world * (after.T_world_imu.translation - before.T_world_imu.translation);
  const double rate = 1e9 / static_cast<double>(after.stamp_ns - before.stamp_ns);
  return {rate * w.x(), rate * w.y(), rate * w.z(), rate * way.x(), rate * way.y(), rate * way.z()};
}

GivenViews CollectKeyframes(const OdometryRun& run) {
  GivenViews given;
  size_t at = 0;
  for (const Keyframe& keyframe : run.keyframes) {
    given.views.push_back({keyframe.stamp_ns, keyframe.segment, keyframe.T_world_imu});
    while (at < run.states.size() && run.states[at].stamp_ns < keyframe.stamp_ns) ++at;
    const bool is_there = at < run.states.size() && run.states[at].stamp_ns == keyframe.stamp_ns;
    given.speeds.push_back(is_there ? SpeedAt(run.states, at) : PoseMove{});
  }
  return given;
}

void Report(const ExternalPoseFigures& figures) {
  spdlog::info(
      "poses were moved to agree with the images: all by {:.1f} mm, {:.2f} degrees and {:.1f} ms, "
      "each by {:.1f} mm and {:.2f} degrees (RMS of {} views); points of {} pairs of views were "
      "{:.2f} px off, now {:.2f} px",
      1e3 * figures.body_shifted_m, kDegreesPerRadian * figures.body_turned_rad,
      1e3 * figures.clock_s, 1e3 * figures.moved_m, kDegreesPerRadian * figures.turned_rad,
      figures.views, figures.pairs, figures.given_off_px, figures.off_px);
}

// With the poses of a motion tracker 0.34 px stay (EuRoC V1_01), with these 3 % too large 1.6 px.
void WarnWhereTheyStayOff(const ExternalPoseFigures& figures, OdometryRun* run) {
  constexpr double kMost_px = 1;
  if (figures.off_px <= kMost_px) return;
  ++run->warnings[kPosesDisagree];
  spdlog::warn(
      "poses and images stay {:.2f} px apart, expected at most {} px: are the poses those of the "
      "IMU, in metres, and the cameras calibrated?",
      figures.off_px, kMost_px);
}

}  // namespace

std::optional<AdjustedViews> AdjustGivenViews(const GivenViews& given, const ViewImages& images,
                                              const ExternalPoseOptions& options,
                                              const Progress& progress) {
  constexpr double kPoints = 0.5, kMatched = 0.9;  // shares of the time: of all, of a round
  options.Check();
  if (!options.adjust) return std::nullopt;
  const Rig& rig = images.rig();
  const std::vector<std::vector<ViewPoint>> points =
      PointsOfViews(given.views, images, progress.Part(0, kPoints));
  const Progress moving = progress.Part(kPoints, 1);
  AdjustedViews adjusted{given.views, {}, {}};
  ExternalPoseFigures& figures = adjusted.figures;
  adjusted.correction.own.resize(given.views.size());
  for (int round = 0; round < kRounds; ++round) {
    const Progress part = moving.Part(1.0 * round / kRounds, 1.0 * (round + 1) / kRounds);
    const std::vector<PoseMatch> matches =
        MatchViews(adjusted.views, points, images, part.Part(0, kMatched));
    const std::vector<double> given_px = OffOfPairs_px(matches, given.views, rig);
    if (given_px.empty()) return std::nullopt;
    figures.given_off_px = Quantile(given_px, 0.5);
    if (figures.given_off_px <= kGood_px) return std::nullopt;
    const auto found =
        AdjustPoses(given, adjusted.correction, matches, rig, options, part.Part(kMatched, 1));
    if (!found) return NotAdjusted("no solution", figures.given_off_px);
    adjusted.correction = *found;
    adjusted.views = Corrected(given, *found);
    const std::vector<double> px = OffOfPairs_px(matches, adjusted.views, rig);
    if (px.empty() || Quantile(px, 0.5) >= figures.given_off_px) {
      return NotAdjusted("no gain", figures.given_off_px);
    }
    figures.pairs = std::ssize(given_px);
    figures.points = std::ssize(matches);
    figures.off_px = Quantile(px, 0.5);
  }
  figures.views = std::ssize(given.views);
  SetMoves(adjusted.correction, &figures);
  return adjusted;
}

std::vector<OnlineState> CorrectedStates(const std::vector<OnlineState>& states,
                                         const PoseCorrection& correction) {
  std::vector<OnlineState> corrected = states;
  for (size_t i = 0; i < states.size(); ++i) {
    corrected[i].T_world_imu =
        CorrectedPose(states[i].T_world_imu, correction, SpeedAt(states, i), PoseMove{});
  }
  return corrected;
}

std::optional<ExternalPoseFigures> AdjustExternalPoses(const ViewImages& images,
                                                       const ExternalPoseOptions& options,
                                                       OdometryRun* run, const Progress& progress) {
  if (run->keyframes.empty()) return std::nullopt;
  try {
    const auto adjusted = AdjustGivenViews(CollectKeyframes(*run), images, options, progress);
    if (!adjusted) return std::nullopt;
    run->states = CorrectedStates(run->states, adjusted->correction);
    for (size_t i = 0; i < run->keyframes.size(); ++i) {
      run->keyframes[i].T_world_imu = adjusted->views[i].T_world_imu;
    }
    Report(adjusted->figures);
    WarnWhereTheyStayOff(adjusted->figures, run);
    return adjusted->figures;
  } catch (const StoppedError&) {
    spdlog::debug("the adjustment of poses was interrupted");
    return std::nullopt;
  }
}

}  // namespace slcmap::mapping
