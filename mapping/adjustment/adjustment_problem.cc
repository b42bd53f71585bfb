#include "mapping/adjustment/adjustment_problem.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "mapping/adjustment/closure_terms.h"
#include "mapping/adjustment/elimination_order.h"
#include "mapping/adjustment/first_pose_residual.h"
#include "mapping/adjustment/line_distance_residual.h"
#include "mapping/adjustment/solver_progress.h"
#include "odometry/residuals/along_axis_residual.h"
#include "odometry/residuals/along_slope_residual.h"
#include "odometry/residuals/as_given_residual.h"
#include "odometry/residuals/general_line_residual.h"
#include "odometry/residuals/structural_line_residual.h"
#include "odometry/window/calibration_estimate.h"

namespace slcmap {
namespace {

// Of a segment's first keyframe, as WindowOptions has them: weak, but where nothing else tells of
// them the problem has to have a solution.
constexpr double kVelocitySigma_m_s = 2, kGyroBiasSigma_rad_s = 0.1, kAccelBiasSigma_m_s2 = 0.2;

// Of the inverse distance of a line, about where it is. Hardly anything for a line whose place
// images tell; one that they do not, as of a single image, would run away beyond all bounds and
// take the solver's steps along, so that most of them failed.
constexpr double kLineDistanceSigma = 0.3;

// Where the solver starts to trust its steps. What all keyframes have in common, as the scale and
// the calibration, tells little in any one of them, and with Ceres' 1e4 rounds ended before it had
// settled: a corridor's map came out 0.09 % too long. With more than the most, damping is lost in
// the rounding of the equations.
constexpr double kTrust = 1e8, kTrustOfLittle = 1e2, kMaxTrust = 1e9;

// One over what is believed of the calibration at first; large for what is not estimated.
CalibrationVector FirstWeights(const CalibrationOptions& options) {
  return CalibrationPrior(options).belief().covariance.diagonal().cwiseSqrt().cwiseInverse();
}

void AddTerm(AdjustmentTerm term, ceres::Problem* problem) {
  problem->AddResidualBlock(term.factor.release(), term.loss, term.blocks);
}

void AddCalibrationTerms(const AdjustmentModel& model, const AdjustmentState& state,
                         ceres::Problem* problem) {
  for (const CalibrationVector& weights : {model.prior_weights, model.tie_weights}) {
    if (weights.isZero(0)) continue;
    problem->AddResidualBlock(
        new AsGivenResidual(kImuCalibrationKind, weights.head<kImuCalibrationSize>()), nullptr,
        state.imu_calibration);
    problem->AddResidualBlock(
        new AsGivenResidual(kCameraCalibrationKind, weights.tail<kCameraCalibrationSize>()),
        nullptr, state.camera_calibration);
  }
}

void AddFirstFrameTerms(const AdjustedFrame& frame, ceres::Problem* problem) {
  problem->AddResidualBlock(new FirstPoseResidual(PoseFromBlock(frame.pose)), nullptr, frame.pose);
  Eigen::VectorXd weights(kSpeedBiasSize);
  weights << Eigen::Vector3d::Constant(1 / kVelocitySigma_m_s),
      Eigen::Vector3d::Constant(1 / kGyroBiasSigma_rad_s),
      Eigen::Vector3d::Constant(1 / kAccelBiasSigma_m_s2);
  problem->AddResidualBlock(new AsGivenResidual(kSpeedBiasKind, weights), nullptr,
                            frame.speed_bias);
}

void AddFrameTerms(const AdjustmentState& state, ceres::Problem* problem) {
  for (size_t k = 0; k < state.frames.size(); ++k) {
    const AdjustedFrame& frame = state.frames[k];
    problem->AddParameterBlock(frame.pose, kPoseSize, SharedPoseManifold());
    problem->AddParameterBlock(frame.speed_bias, kSpeedBiasSize);
    if (frame.from_previous) {
      AddTerm(ImuTerm(k, state), problem);
    } else {
      AddFirstFrameTerms(frame, problem);
    }
  }
}

AdjustmentTerm AxisTerm(const AdjustedLine& line, const AdjustmentModel& model) {
  AdjustmentTerm term;
  term.loss = model.axis_loss.get();
  if (line.slope) {
    term.factor = std::make_unique<AlongSlopeResidual>(line.deviation_sigma_rad);
    term.blocks = {line.slope, line.block};
    return term;
  }
  term.factor = std::make_unique<AlongAxisResidual>(line.axis, line.deviation_sigma_rad,
                                                    line.share != nullptr);
  if (line.heading) term.blocks.push_back(line.heading);
  if (line.share) term.blocks.push_back(line.share);
  term.blocks.push_back(line.block);
  return term;
}

void AddLineTerms(const AdjustmentOptions& options, const AdjustmentModel& model,
                  const AdjustmentState& state, ceres::Problem* problem) {
  for (const AdjustedShare& share : state.shares) {
    problem->AddResidualBlock(new SharedDeviationResidual(state.share_sigma_rad), nullptr,
                              share.block);
  }
  for (const AdjustedLine& line : state.lines) {
    if (line.observations.empty()) continue;
    if (!line.exact) problem->AddParameterBlock(line.block, kGeneralLineSize, SharedLineManifold());
    const BlockKind& kind = line.exact ? kStructuralLineKind : kGeneralLineKind;
    problem->AddResidualBlock(new LineDistanceResidual(kind, line.block, kLineDistanceSigma),
                              nullptr, line.block);
    const double count = static_cast<double>(line.observations.size());
    const double weight = std::sqrt(std::min(1.0, options.line_observations / count));
    for (const AdjustedLineObservation& observation : line.observations) {
      AddTerm(LineTerm(line, observation, weight, state, model), problem);
    }
    if (!line.exact && line.axis != LineAxis::kNone) AddTerm(AxisTerm(line, model), problem);
  }
}

// Points and short lines, but those that closures bind to each other.
std::vector<double*> EliminatedFirst(const AdjustmentOptions& options, const AdjustmentState& state,
                                     const std::vector<Closure>& closures) {
  std::set<const double*> bound;
  for (const Closure& closure : closures) {
    if (closure.taken_back) continue;
    for (const EdgeMatch& match : closure.edges) {
      bound.insert(state.lines[match.older].block);
      bound.insert(state.lines[match.newer].block);
    }
  }
  std::vector<double*> first;
  for (const AdjustedPoint& point : state.points) {
    if (!point.observations.empty()) first.push_back(point.block);
  }
  for (const AdjustedLine& line : state.lines) {
    const auto count = std::ssize(line.observations);
    if (count == 0 || count > options.max_eliminated_observations) continue;
    if (!bound.contains(line.block)) first.push_back(line.block);
  }
  return first;
}

// What all of a recording is tied to.
std::vector<double*> EliminatedLast(const AdjustmentState& state, const ceres::Problem& problem) {
  std::vector<double*> last{state.imu_calibration, state.camera_calibration};
  last.insert(last.end(), state.headings.begin(), state.headings.end());
  last.insert(last.end(), state.slopes.begin(), state.slopes.end());
  std::erase_if(last, [&](double* block) { return !problem.HasParameterBlock(block); });
  return last;
}

// The first rows of a term's residual at its blocks.
double SquaredRows(const AdjustmentTerm& term, int rows) {
  std::array<double, 15> residuals;
  term.factor->Evaluate(term.blocks.data(), residuals.data(), nullptr);
  return Eigen::Map<const Eigen::VectorXd>(residuals.data(), rows).squaredNorm();
}

}  // namespace

AdjustmentModel::AdjustmentModel(const OdometryRun& run, const AdjustmentOptions& options)
    : points(run.rectified_rig.T_imu_camera,
             run.rectified_rig.cameras[0].fx_px / options.point_sigma_px),
      lines(run.rectified_rig.T_imu_camera,
            run.rectified_rig.cameras[0].fx_px / options.line_sigma_px),
      matched_points(run.rectified_rig.T_imu_camera,
                     run.rectified_rig.cameras[0].fx_px / options.closures.point_sigma_px),
      edge_sigma_m(options.closures.edge_sigma_m),
      point_loss(std::make_unique<ceres::HuberLoss>(options.point_loss_sigma)),
      line_loss(std::make_unique<ceres::HuberLoss>(options.line_loss_sigma)),
      axis_loss(std::make_unique<ceres::CauchyLoss>(options.axis_loss_sigma)),
      closure_loss_sigma(options.closures.loss_sigma),
      prior_weights(FirstWeights(options.calibration)) {
  GraduateClosures(1);
  if (!run.source) return;
  points.lens_shifts = lines.lens_shifts = matched_points.lens_shifts =
      std::make_shared<const std::array<LensShift, 2>>(
          LensShiftsOf(run.source->raw_rig, run.rectified_rig));
}

void AdjustmentModel::GraduateClosures(double factor) {
  closure_loss = std::make_unique<ceres::CauchyLoss>(factor * closure_loss_sigma);
}

AdjustmentTerm PointTerm(const AdjustedPoint& point, const AdjustedPointObservation& observation,
                         const AdjustmentState& state, const AdjustmentModel& model) {
  AdjustmentTerm term;
  term.loss = model.point_loss.get();
  if (observation.frame == point.host) {
    term.factor = std::make_unique<HostPointResidual>(model.points, observation.measurement);
    term.blocks = {state.camera_calibration, point.block};
  } else {
    term.factor = std::make_unique<PointResidual>(&model.points, observation.measurement);
    term.blocks = {state.frames[point.host].pose, state.frames[observation.frame].pose,
                   state.camera_calibration, point.block};
  }
  return term;
}

AdjustmentTerm LineTerm(const AdjustedLine& line, const AdjustedLineObservation& observation,
                        double weight, const AdjustmentState& state, const AdjustmentModel& model) {
  StereoLineMeasurement measurement = observation.measurement;
  measurement.weight = weight;
  AdjustmentTerm term;
  term.loss = model.line_loss.get();
  term.blocks = {state.frames[observation.frame].pose, state.camera_calibration};
  if (line.exact) {
    const StructuralLine structural{line.axis, line.anchor_world};
    term.factor =
        std::make_unique<StructuralLineResidual>(&model.lines, structural, measurement, true);
    if (line.heading) term.blocks.push_back(line.heading);
  } else {
    term.factor =
        std::make_unique<GeneralLineResidual>(&model.lines, line.anchor_world, measurement, true);
  }
  term.blocks.push_back(line.block);
  return term;
}

AdjustmentTerm ImuTerm(size_t frame, const AdjustmentState& state) {
  const AdjustedFrame &from = state.frames[frame - 1], &to = state.frames[frame];
  AdjustmentTerm term;
  term.factor = std::make_unique<ImuResidual>(to.from_previous.get(), from.cut, to.cut);
  term.blocks = {from.pose, from.speed_bias, to.pose, to.speed_bias, state.imu_calibration};
  return term;
}

double Chi2(const AdjustmentTerm& term) { return SquaredRows(term, term.factor->rows()); }
double Chi2OfLeft(const AdjustmentTerm& term) { return SquaredRows(term, 2); }

std::unique_ptr<ceres::Problem> BuildProblem(const AdjustmentOptions& options,
                                             const AdjustmentModel& model,
                                             const AdjustmentState& state,
                                             const std::vector<Closure>& closures) {
  ceres::Problem::Options ownership;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.disable_all_safety_checks = true;
  auto problem = std::make_unique<ceres::Problem>(ownership);
  AddFrameTerms(state, problem.get());
  AddCalibrationTerms(model, state, problem.get());
  for (const AdjustedPoint& point : state.points) {
    for (const AdjustedPointObservation& observation : point.observations) {
      AddTerm(PointTerm(point, observation, state, model), problem.get());
    }
  }
  AddLineTerms(options, model, state, problem.get());
  AddClosureTerms(closures, state, model, problem.get());
  return problem;
}

RoundSummary SolveProblem(const AdjustmentOptions& options, const AdjustmentState& state,
                          const std::vector<Closure>& closures, double settled,
                          ceres::Problem* problem, const Progress& progress) {
  const bool closes = std::ranges::any_of(closures, [](const Closure& c) { return !c.taken_back; });
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::SPARSE_SCHUR;
  solver.linear_solver_ordering = EliminationOrder(
      *problem, EliminatedFirst(options, state, closures), EliminatedLast(state, *problem));
  solver.num_threads = 1;  // sums of several threads come in any order
  solver.max_num_iterations = closes ? 2 * options.max_iterations : options.max_iterations;
  solver.max_num_consecutive_invalid_steps = solver.max_num_iterations;
  solver.initial_trust_region_radius = kTrust;
  solver.max_trust_region_radius = kMaxTrust;
  solver.function_tolerance = settled;
  solver.logging_type = ceres::SILENT;
  SolverProgress callback(progress, solver.max_num_iterations);
  solver.callbacks = {&callback};
  ceres::Solver::Summary summary;
  ceres::Solve(solver, problem, &summary);
  if (!callback.stopped() && !(summary.final_cost < summary.initial_cost)) {
    // So far off that no step from there held, or settled.
    solver.initial_trust_region_radius = kTrustOfLittle;
    ceres::Solve(solver, problem, &summary);
  }
  if (callback.stopped()) throw StoppedError("interrupted");
  RoundSummary out;
  out.usable = summary.IsSolutionUsable() && std::isfinite(summary.final_cost);
  out.iterations = static_cast<int>(summary.iterations.size());
  out.initial_cost = summary.initial_cost;
  out.final_cost = summary.final_cost;
  return out;
}

}  // namespace slcmap
