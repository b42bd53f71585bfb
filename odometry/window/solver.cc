#include "odometry/window/solver.h"

#include <ceres/ordered_groups.h>
#include <ceres/solver.h>

#include <memory>

namespace slcmap {
namespace {

ceres::Problem::Options BorrowEverything() {
  ceres::Problem::Options options;
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.disable_all_safety_checks = true;
  return options;
}

void AddTerms(std::vector<Term>* terms, ceres::Manifold* manifold, ceres::Problem* problem) {
  for (Term& term : *terms) {
    const Factor& factor = *term.factor;
    for (int k = 0; k < factor.blocks(); ++k) {
      const int size = factor.parameter_block_sizes()[k];
      if (size == kPoseSize && !problem->HasParameterBlock(term.blocks[k])) {
        problem->AddParameterBlock(term.blocks[k], kPoseSize, manifold);
      }
    }
    problem->AddResidualBlock(term.factor.get(), term.loss, term.blocks.data(), factor.blocks());
  }
}

void AddPrior(PriorResidual* residual, const Prior& prior, ceres::Manifold* manifold,
              ceres::Problem* problem) {
  for (size_t k = 0; k < prior.blocks.size(); ++k) {
    if (prior.block_sizes[k] == kPoseSize && !problem->HasParameterBlock(prior.blocks[k])) {
      problem->AddParameterBlock(prior.blocks[k], kPoseSize, manifold);
    }
  }
  problem->AddResidualBlock(residual, nullptr, prior.blocks);
}

ceres::Solver::Options CeresOptions(const ceres::Problem& problem,
                                    const std::function<bool(const double*)>& is_constant,
                                    const SolverOptions& options) {
  ceres::Solver::Options out;
  out.max_num_iterations = options.max_iterations;
  out.function_tolerance = options.function_tolerance;
  out.num_threads = 1;
  out.logging_type = ceres::SILENT;
  out.linear_solver_type = ceres::DENSE_QR;
  std::vector<double*> blocks;
  problem.GetParameterBlocks(&blocks);
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (double* block : blocks) {
    const bool landmark = problem.ParameterBlockSize(block) == kPointSize;
    ordering->AddElementToGroup(block, landmark ? 0 : 1);
    if (landmark && !is_constant(block)) out.linear_solver_type = ceres::DENSE_SCHUR;
  }
  if (out.linear_solver_type == ceres::DENSE_SCHUR) out.linear_solver_ordering = ordering;
  return out;
}

}  // namespace

SolverSummary Solve(std::vector<Term>* terms, const Prior& prior,
                    const std::function<bool(const double*)>& is_constant,
                    const SolverOptions& options) {
  PoseManifold manifold;
  PriorResidual prior_residual(&prior);
  ceres::Problem problem(BorrowEverything());
  AddTerms(terms, &manifold, &problem);
  if (!prior.empty()) AddPrior(&prior_residual, prior, &manifold, &problem);
  std::vector<double*> blocks;
  problem.GetParameterBlocks(&blocks);
  for (double* block : blocks) {
    if (is_constant(block)) problem.SetParameterBlockConstant(block);
  }
  ceres::Solver::Summary summary;
  ceres::Solve(CeresOptions(problem, is_constant, options), &problem, &summary);
  return {summary.IsSolutionUsable(), static_cast<int>(summary.iterations.size()),
          summary.final_cost};
}

}  // namespace slcmap
