#include "mapping/adjustment/closure_terms.h"

#include <ceres/crs_matrix.h>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>

#include "mapping/adjustment/residuals.h"

namespace slcmap::inline mapping {
namespace {

using SparseMatrix = Eigen::SparseMatrix<double>;

// of a closure's matches, that fit at the end; else it is taken back
constexpr double kMinAgreeing = 0.6;
// of odometry's links (15 rows); more, and closures are taken back
constexpr double kMaxLinkChi2 = 35;

constexpr double kOfNothing = 1e-9;  // of what a number's own observations say of it

struct Columns {
  int first = 0, count = 0;
};

// The Jacobian at the problem's state, and where the columns of the wanted blocks are.
SparseMatrix EvaluateJacobian(ceres::Problem* problem, const std::vector<double*>& blocks,
                              std::vector<Columns>* wanted) {
  ceres::Problem::EvaluateOptions options;
  problem->GetParameterBlocks(&options.parameter_blocks);
  ceres::CRSMatrix rows;
  problem->Evaluate(options, nullptr, nullptr, nullptr, &rows);
  wanted->assign(blocks.size(), {});
  int column = 0;
  for (double* block : options.parameter_blocks) {
    const int count = problem->ParameterBlockTangentSize(block);
    const auto it = std::ranges::find(blocks, block);
    if (it != blocks.end()) {
      (*wanted)[static_cast<size_t>(it - blocks.begin())] = {column, count};
    }
    column += count;
  }
  using RowMajor = Eigen::SparseMatrix<double, Eigen::RowMajor>;
  return Eigen::Map<const RowMajor>(rows.num_rows, rows.num_cols, std::ssize(rows.values),
                                    rows.rows.data(), rows.cols.data(), rows.values.data());
}

}  // namespace

Eigen::MatrixXd BlockCovariance(ceres::Problem* problem, const std::vector<double*>& blocks) {
  std::vector<Columns> wanted;
  SparseMatrix jacobian = EvaluateJacobian(problem, blocks, &wanted);
  // In units of what each number's own observations say of it: what is held has a millionth of the
  // standard deviation of others.
  Eigen::VectorXd scale(jacobian.cols());
  for (int k = 0; k < jacobian.outerSize(); ++k) {
    const double norm = jacobian.col(k).norm();
    if (!(norm > 0)) return {};
    scale[k] = 1 / norm;
  }
  jacobian = jacobian * scale.asDiagonal();
  SparseMatrix information(jacobian.cols(), jacobian.cols());
  information.selfadjointView<Eigen::Lower>().rankUpdate(SparseMatrix(jacobian.transpose()));
  // What nothing says of a block says nothing of others either.
  for (Eigen::Index k = 0; k < information.cols(); ++k) information.coeffRef(k, k) += kOfNothing;
  const Eigen::SimplicialLDLT<SparseMatrix> cholesky(information);
  if (cholesky.info() != Eigen::Success) return {};
  Eigen::Index size = 0;
  for (const Columns& columns : wanted) size += columns.count;
  Eigen::MatrixXd units = Eigen::MatrixXd::Zero(information.cols(), size);
  Eigen::Index next = 0;
  for (const Columns& columns : wanted) {
    for (int i = 0; i < columns.count; ++i)
      units(columns.first + i, next++) = scale[columns.first + i];
  }
  const Eigen::MatrixXd solved = cholesky.solve(units);
  Eigen::MatrixXd covariance = units.transpose() * solved;
  if (!covariance.allFinite() || covariance.diagonal().minCoeff() < 0) return {};
  const Eigen::VectorXd own = units.colwise().squaredNorm();  // by their own observations
  if ((covariance.diagonal().array() > 0.1 / kOfNothing * own.array()).any()) return {};
  return covariance;
}

namespace {

constexpr double kMaxMatchChi2 = 9;   // of two rows, that fits
constexpr double kLinkChi2Risen = 9;  // that closures are blamed for

struct ClosureFit {
  double agreeing = 0;   // share of its matches
  double mean_chi2 = 0;  // of a match
};

ClosureFit ComputeFit(const Closure& closure, const AdjustmentState& state,
                      const AdjustmentModel& model) {
  std::vector<double> chi2;
  for (const PointMatch& match : closure.points) {
    chi2.push_back(Chi2(PointMatchTerm(match, state, model)));
  }
  for (const EdgeMatch& match : closure.edges) {
    chi2.push_back(Chi2(EdgeMatchTerm(match, state, model)));
  }
  ClosureFit fit;
  const double count = std::max(1.0, static_cast<double>(chi2.size()));
  for (const double value : chi2) {
    fit.agreeing += (value < kMaxMatchChi2) / count;
    fit.mean_chi2 += value / count;
  }
  return fit;
}

int TakeBackMisfits(const AdjustmentState& state, const AdjustmentModel& model,
                    std::vector<Closure>* closures) {
  int taken_back = 0;
  for (Closure& closure : *closures) {
    if (closure.taken_back || ComputeFit(closure, state, model).agreeing >= kMinAgreeing) {
      continue;
    }
    closure.taken_back = true;
    ++taken_back;
  }
  return taken_back;
}

// Of those that span a link, the one that fits worst; null where there is none.
Closure* WorstAcross(size_t link, const AdjustmentState& state, const AdjustmentModel& model,
                     std::vector<Closure>* closures) {
  Closure* worst = nullptr;
  double most = -1;
  for (Closure& closure : *closures) {
    const bool spans = closure.older_frame < link && link <= closure.newer_frame;
    if (closure.taken_back || !spans) continue;
    const double chi2 = ComputeFit(closure, state, model).mean_chi2;
    if (chi2 <= most) continue;
    most = chi2;
    worst = &closure;
  }
  return worst;
}

// By how much a shift of three standard deviations may move a point in the later image.
double GateOf_px(const PointMatch& match, const ShiftSigma& sigma, const ClosureOptions& options,
                 const AdjustmentState& state) {
  const RigidTransform T_world_camera =
      PoseFromBlock(state.frames[match.frame].pose) * state.rig.T_imu_camera[0];
  const double distance_m =
      (PointInWorld(state.points[match.point], state) - T_world_camera.translation).norm();
  return 3 * state.rig.cameras[0].fx_px * (sigma.position_m / distance_m + sigma.yaw_rad) +
         options.point_tolerance_px;
}

// Of one closure; the state's path lengths lead from visit to visit.
void EraseBeyondGate(const ClosureOptions& options, double path_m, const AdjustmentState& state,
                     const AdjustmentModel& model, Closure* closure) {
  const ShiftSigma sigma = SigmaOver(path_m, options);
  std::erase_if(closure->points, [&](const PointMatch& match) {
    const double off_px =
        options.point_sigma_px * std::sqrt(Chi2(PointMatchTerm(match, state, model)));
    return !(off_px <= GateOf_px(match, sigma, options, state));
  });
  std::erase_if(closure->edges, [&](const EdgeMatch& match) {
    const double off_m = kClosureEdgeSigma_m * std::sqrt(Chi2(EdgeMatchTerm(match, state, model)));
    return !(off_m <= 3 * sigma.position_m);
  });
}

}  // namespace

int RefuseBeyondGate(const ClosureOptions& options, const AdjustmentState& state,
                     const AdjustmentModel& model, std::vector<Closure>* closures) {
  const std::vector<double> path_m = PathLengths(state);
  int taken_back = 0;
  for (Closure& closure : *closures) {
    const size_t before = closure.points.size() + closure.edges.size();
    EraseBeyondGate(options, path_m[closure.newer_frame] - path_m[closure.older_frame], state,
                    model, &closure);
    closure.taken_back = 2 * (closure.points.size() + closure.edges.size()) <= before;
    taken_back += closure.taken_back;
  }
  return taken_back;
}

AdjustmentTerm PointMatchTerm(const PointMatch& match, const AdjustmentState& state,
                              const AdjustmentModel& model) {
  const AdjustedPoint& point = state.points[match.point];
  AdjustmentTerm term;
  term.loss = model.closure_loss.get();
  term.factor = std::make_unique<PointResidual>(&model.matched_points,
                                                StereoMeasurement{match.left, std::nullopt});
  term.blocks = {state.frames[point.host].pose, state.frames[match.frame].pose,
                 state.camera_calibration, point.block};
  return term;
}

AdjustmentTerm EdgeMatchTerm(const EdgeMatch& match, const AdjustmentState& state,
                             const AdjustmentModel& model) {
  const AdjustedLine &older = state.lines[match.older], &newer = state.lines[match.newer];
  AdjustmentTerm term;
  term.loss = model.closure_loss.get();
  if (newer.exact) {
    term.factor = std::make_unique<SameStructuralEdgeResidual>(
        newer.axis, older.anchor_world, newer.anchor_world, model.edge_sigma_m);
    if (newer.heading) term.blocks.push_back(newer.heading);
  } else {
    const PointAndDirection a = older.InWorld(), b = newer.InWorld();
    const Eigen::Vector3d middle =
        NearestOn(b, 0.5 * (newer.line->start_world + newer.line->end_world));
    const auto end = [&](const AdjustedLine& line, const PointAndDirection& in_world) {
      return SameFreeEdgeResidual::End{line.anchor_world,
                                       in_world.direction_world.dot(middle - in_world.point_world)};
    };
    term.factor = std::make_unique<SameFreeEdgeResidual>(
        end(older, a), end(newer, b), AxesAcross(newer.axis, newer.heading ? *newer.heading : 0),
        model.edge_sigma_m);
  }
  term.blocks.insert(term.blocks.end(), {older.block, newer.block});
  return term;
}

void AddClosureTerms(const std::vector<Closure>& closures, const AdjustmentState& state,
                     const AdjustmentModel& model, ceres::Problem* problem) {
  const auto add = [&](AdjustmentTerm term) {
    problem->AddResidualBlock(term.factor.release(), term.loss, term.blocks);
  };
  for (const Closure& closure : closures) {
    if (closure.taken_back) continue;
    for (const PointMatch& match : closure.points) add(PointMatchTerm(match, state, model));
    for (const EdgeMatch& match : closure.edges) add(EdgeMatchTerm(match, state, model));
  }
}

std::vector<double> LinkChi2(const AdjustmentState& state) {
  std::vector<double> chi2;
  for (size_t k = 0; k < state.frames.size(); ++k) {
    chi2.push_back(state.frames[k].from_previous ? Chi2(ImuTerm(k, state)) : 0);
  }
  return chi2;
}

int TakeBackClosures(const std::vector<double>& links, const AdjustmentState& state,
                     const AdjustmentModel& model, std::vector<Closure>* closures) {
  int taken_back = TakeBackMisfits(state, model, closures);
  const std::vector<double> now = LinkChi2(state);
  for (size_t k = 0; k < now.size(); ++k) {
    if (now[k] <= kMaxLinkChi2 || now[k] <= links[k] + kLinkChi2Risen) continue;
    Closure* worst = WorstAcross(k, state, model, closures);
    if (!worst) continue;
    worst->taken_back = true;
    return taken_back + 1;
  }
  return taken_back;
}

}  // namespace slcmap::mapping
