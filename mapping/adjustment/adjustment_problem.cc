#include "mapping/adjustment/adjustment_problem.h"

#include <metis.h>
#include <signal.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <set>
#include <unordered_map>

#include "data/core/error.h"
#include "mapping/adjustment/closure_terms.h"
#include "mapping/adjustment/residuals.h"
#include "odometry/factors/calibration_estimate.h"
#include "odometry/factors/factor.h"
#include "odometry/factors/line_constraints.h"
#include "odometry/factors/line_residual.h"
#include "odometry/structure/building_deviation.h"

namespace slcmap::inline mapping {
namespace {

constexpr double kLossSigma = 0.5;       // where the losses of points and lines turn linear
constexpr double kControlLossSigma = 3;  // where that of control points flattens
// So many observations of one edge count in full; more share their weight, since what one edge
// errs in (a wall that bends, a calibration that is off) does not average out over its views.
constexpr int kLineObservations = 10;
// A line that more keyframes saw stays in the reduced system, which eliminating it would fill.
constexpr int kMaxEliminatedObservations = 50;

// Blocks by their place in the problem; each vertex knows its neighbours.
using Neighbours = std::vector<std::vector<idx_t>>;

constexpr idx_t kLeftOut = -1;  // a block that is no vertex

// METIS sets handlers of its own for the signals that end a program, takes what the thread that it
// runs on gets for an error, and puts others back with other flags. So this thread gets them when
// METIS is done, and their handlers are put back as they were.
class SignalsLater {
 public:
  SignalsLater() {
    sigset_t ending;
    sigemptyset(&ending);
    sigaddset(&ending, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &ending, &mask_);
    sigaction(SIGTERM, nullptr, &on_term_);
    sigaction(SIGABRT, nullptr, &on_abort_);
  }
  ~SignalsLater() {
    sigaction(SIGTERM, &on_term_, nullptr);
    sigaction(SIGABRT, &on_abort_, nullptr);
    pthread_sigmask(SIG_SETMASK, &mask_, nullptr);
  }
  SignalsLater(const SignalsLater&) = delete;
  SignalsLater& operator=(const SignalsLater&) = delete;

 private:
  sigset_t mask_;
  struct sigaction on_term_, on_abort_;
};

// The vertices of a graph, neighbours[begins[v]] to neighbours[begins[v + 1]] of each, in the order
// of their elimination. METIS draws from the C library's numbers, which are the process's.
std::vector<idx_t> NestedDissection(std::vector<idx_t> begins, std::vector<idx_t> neighbours,
                                    std::vector<idx_t> sizes) {
  static std::mutex mutex;
  const std::scoped_lock one_at_a_time(mutex);
  const SignalsLater signals_later;
  auto count = static_cast<idx_t>(sizes.size());
  std::vector<idx_t> order(sizes.size()), place(sizes.size());
  idx_t options[METIS_NOPTIONS];
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_SEED] = 1;
  if (METIS_NodeND(&count, begins.data(), neighbours.data(), sizes.data(), options, order.data(),
                   place.data()) != METIS_OK) {
    throw Error("METIS found no order for the adjustment's equations");
  }
  return order;
}

class BlockGraph {
 public:
  BlockGraph(const ceres::Problem& problem, const std::vector<double*>& first,
             const std::vector<double*>& last)
      : problem_(problem) {
    problem.GetParameterBlocks(&blocks_);
    for (size_t i = 0; i < blocks_.size(); ++i) index_of_.emplace(blocks_[i], i);
    vertex_of_.assign(blocks_.size(), 0);
    for (const auto* left_out : {&first, &last}) {
      for (const double* block : *left_out) vertex_of_[index_of_.at(block)] = kLeftOut;
    }
    for (size_t i = 0; i < blocks_.size(); ++i) {
      if (vertex_of_[i] == kLeftOut) continue;
      vertex_of_[i] = static_cast<idx_t>(vertices_.size());
      vertices_.push_back(i);
    }
    Connect(first);
  }

  // The blocks that are vertices, in the order of their elimination.
  std::vector<double*> ByNestedDissection() {
    if (vertices_.empty()) return {};
    std::vector<idx_t> begins{0}, neighbours, sizes;
    for (size_t v = 0; v < vertices_.size(); ++v) {
      neighbours.insert(neighbours.end(), neighbours_[v].begin(), neighbours_[v].end());
      begins.push_back(static_cast<idx_t>(neighbours.size()));
      sizes.push_back(problem_.ParameterBlockTangentSize(blocks_[vertices_[v]]));
    }
    std::vector<double*> ordered;
    for (const idx_t v : NestedDissection(begins, neighbours, sizes)) {
      ordered.push_back(blocks_[vertices_[static_cast<size_t>(v)]]);
    }
    return ordered;
  }

 private:
  std::vector<idx_t> FindVertices(ceres::ResidualBlockId term, size_t* eliminated) const {
    std::vector<double*> bound;
    problem_.GetParameterBlocksForResidualBlock(term, &bound);
    std::vector<idx_t> vertices;
    for (const double* block : bound) {
      const size_t i = index_of_.at(block);
      if (vertex_of_[i] != kLeftOut) vertices.push_back(vertex_of_[i]);
      if (!is_first_[i]) continue;
      if (*eliminated != blocks_.size()) throw Error("a term binds two blocks of group 0");
      *eliminated = i;
    }
    return vertices;
  }

  // Ties the vertices of each term to each other, and those of all terms of one block of `first`.
  void Connect(const std::vector<double*>& first) {
    is_first_.assign(blocks_.size(), false);
    for (const double* block : first) is_first_[index_of_.at(block)] = true;
    neighbours_.resize(vertices_.size());
    std::vector<std::vector<idx_t>> beside(blocks_.size());  // those of `first`
    std::vector<ceres::ResidualBlockId> terms;
    problem_.GetResidualBlocks(&terms);
    for (const ceres::ResidualBlockId term : terms) {
      size_t eliminated = blocks_.size();
      const std::vector<idx_t> vertices = FindVertices(term, &eliminated);
      if (eliminated == blocks_.size()) {
        LinkVertices(vertices);
      } else {
        beside[eliminated].insert(beside[eliminated].end(), vertices.begin(), vertices.end());
      }
    }
    for (std::vector<idx_t>& vertices : beside) {
      MakeUnique(&vertices);
      LinkVertices(vertices);
    }
    for (std::vector<idx_t>& of : neighbours_) MakeUnique(&of);
  }

  void LinkVertices(const std::vector<idx_t>& vertices) {
    for (const idx_t a : vertices) {
      for (const idx_t b : vertices) {
        if (a != b) neighbours_[static_cast<size_t>(a)].push_back(b);
      }
    }
  }

  static void MakeUnique(std::vector<idx_t>* vertices) {
    std::ranges::sort(*vertices);
    const auto rest = std::ranges::unique(*vertices);
    vertices->erase(rest.begin(), rest.end());
  }

  const ceres::Problem& problem_;
  std::vector<double*> blocks_;
  std::unordered_map<const double*, size_t> index_of_;
  std::vector<idx_t> vertex_of_;  // by block
  std::vector<size_t> vertices_;  // their blocks
  std::vector<bool> is_first_;    // by block
  Neighbours neighbours_;         // by vertex
};

}  // namespace

std::shared_ptr<ceres::ParameterBlockOrdering> EliminationOrder(const ceres::Problem& problem,
                                                                const std::vector<double*>& first,
                                                                const std::vector<double*>& last) {
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (double* block : first) ordering->AddElementToGroup(block, 0);
  int group = 1;
  for (double* block : BlockGraph(problem, first, last).ByNestedDissection()) {
    ordering->AddElementToGroup(block, group++);
  }
  for (double* block : last) ordering->AddElementToGroup(block, group);
  return ordering;
}

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

void AddLineTerms(const AdjustmentModel& model, const AdjustmentState& state,
                  ceres::Problem* problem) {
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
    const double weight = std::sqrt(std::min(1.0, kLineObservations / count));
    for (const AdjustedLineObservation& observation : line.observations) {
      AddTerm(LineTerm(line, observation, weight, state, model), problem);
    }
    if (!line.exact && line.axis != LineAxis::kNone) AddTerm(AxisTerm(line, model), problem);
  }
}

// The point of a landmark, where the state has it; else null.
const AdjustedPoint* FindPoint(const AdjustmentState& state, int64_t landmark_id) {
  const auto point = std::ranges::find_if(state.points, [&](const AdjustedPoint& p) {
    return p.landmark->id == landmark_id && !p.observations.empty();
  });
  return point == state.points.end() ? nullptr : &*point;
}

// Those of the ties whose landmarks the state has. What is wrong by much pulls little.
void AddControlTerms(const ControlTies& ties, const AdjustmentState& state,
                     ceres::LossFunction* loss, ceres::Problem* problem) {
  const RigidTransform& T_imu_camera = state.rig.T_imu_camera[0];
  for (const ControlTie& tie : ties.points) {
    const AdjustedPoint* point = FindPoint(state, tie.landmark_id);
    if (!point) continue;
    problem->AddResidualBlock(new MeasuredPointResidual(T_imu_camera, tie), loss,
                              {state.frames[point->host].pose, state.control_shift, point->block});
  }
  for (const DistanceTie& tie : ties.distances) {
    const AdjustedPoint *from = FindPoint(state, tie.from_id), *to = FindPoint(state, tie.to_id);
    if (!from || !to) continue;
    const bool one_host = from->host == to->host;
    std::vector<double*> blocks = {from->block, to->block};
    if (!one_host) {
      blocks.insert(blocks.end(), {state.frames[from->host].pose, state.frames[to->host].pose});
    }
    problem->AddResidualBlock(new KnownDistanceResidual(T_imu_camera, tie, one_host), loss, blocks);
  }
}

// Points and short lines, but those that closures or known distances bind to each other.
std::vector<double*> EliminatedFirst(const AdjustmentState& state,
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
    if (!point.observations.empty() && !point.is_tied) first.push_back(point.block);
  }
  for (const AdjustedLine& line : state.lines) {
    const auto count = std::ssize(line.observations);
    if (count == 0 || count > kMaxEliminatedObservations) continue;
    if (!bound.contains(line.block)) first.push_back(line.block);
  }
  return first;
}

// What all of a recording is tied to.
std::vector<double*> EliminatedLast(const AdjustmentState& state, const ceres::Problem& problem) {
  std::vector<double*> last{state.imu_calibration, state.camera_calibration};
  last.insert(last.end(), state.headings.begin(), state.headings.end());
  last.insert(last.end(), state.slopes.begin(), state.slopes.end());
  last.push_back(state.control_shift);
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
      edge_sigma_m(kClosureEdgeSigma_m),
      point_loss(std::make_unique<ceres::HuberLoss>(kLossSigma)),
      line_loss(std::make_unique<ceres::HuberLoss>(kLossSigma)),
      axis_loss(std::make_unique<ceres::CauchyLoss>(kDeviationLossSigma)),
      control_loss(std::make_unique<ceres::CauchyLoss>(kControlLossSigma)),
      closure_loss_sigma(options.closures.loss_sigma),
      prior_weights(FirstWeights(options.calibration)) {
  GraduateClosures(1);
  if (!run.source) return;
  points.lens_shifts = lines.lens_shifts = matched_points.lens_shifts =
      std::make_shared<const std::vector<LensShift>>(
          ComputeLensShifts(run.source->raw_rig, run.rectified_rig));
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
    term.factor =
        std::make_unique<PointResidual>(&model.points, observation.measurement, point.camera);
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

std::unique_ptr<ceres::Problem> BuildProblem(const AdjustmentModel& model,
                                             const AdjustmentState& state,
                                             const std::vector<Closure>& closures,
                                             const ControlTies& ties) {
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
  AddLineTerms(model, state, problem.get());
  AddClosureTerms(closures, state, model, problem.get());
  AddControlTerms(ties, state, model.control_loss.get(), problem.get());
  return problem;
}

RoundSummary SolveProblem(const AdjustmentOptions& options, const AdjustmentState& state,
                          const std::vector<Closure>& closures, double settled,
                          ceres::Problem* problem, const Progress& progress) {
  const bool closes = std::ranges::any_of(closures, [](const Closure& c) { return !c.taken_back; });
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::SPARSE_SCHUR;
  solver.linear_solver_ordering =
      EliminationOrder(*problem, EliminatedFirst(state, closures), EliminatedLast(state, *problem));
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

}  // namespace slcmap::mapping
