#include "odometry/window/solver.h"

#include <ceres/ordered_groups.h>
#include <ceres/solver.h>

#include <algorithm>
#include <memory>
#include <unordered_map>
#include <utility>

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

// Copies of all blocks, side by side in the order in which they were met. Ceres orders blocks by
// their addresses, and sums in that order: solving on the copies, the result does not depend on
// where the states happen to lie in memory.
class Workspace {
 public:
  void Meet(double* block, int size) {
    if (offsets_.try_emplace(block, values_.size()).second) {
      order_.push_back({block, size});
      values_.insert(values_.end(), block, block + size);
    }
  }
  double* At(double* block) { return values_.data() + offsets_.at(block); }
  const std::vector<std::pair<double*, int>>& order() const { return order_; }
  void CopyBack() {
    for (const auto& [block, size] : order_) std::copy_n(At(block), size, block);
  }

 private:
  std::vector<std::pair<double*, int>> order_;
  std::unordered_map<double*, size_t> offsets_;  // only looked up
  std::vector<double> values_;
};

Workspace Gather(const std::vector<Term>& terms, const Prior& prior) {
  Workspace workspace;
  for (size_t k = 0; k < prior.blocks.size(); ++k) {
    workspace.Meet(prior.blocks[k], prior.block_sizes[k]);
  }
  for (const Term& term : terms) {
    const auto& sizes = term.factor->parameter_block_sizes();
    for (int k = 0; k < term.factor->blocks(); ++k) workspace.Meet(term.blocks[k], sizes[k]);
  }
  return workspace;
}

void AddBlocks(const std::function<bool(const double*)>& is_constant, Workspace* workspace,
               ceres::Problem* problem) {
  for (const auto& [block, size] : workspace->order()) {
    double* at = workspace->At(block);
    problem->AddParameterBlock(at, size, ManifoldOf(size));
    if (is_constant(block)) problem->SetParameterBlockConstant(at);
  }
}

void AddTerms(std::vector<Term>* terms, Workspace* workspace, ceres::Problem* problem) {
  for (Term& term : *terms) {
    std::array<double*, Factor::kMaxBlocks> at{};
    for (int k = 0; k < term.factor->blocks(); ++k) at[k] = workspace->At(term.blocks[k]);
    problem->AddResidualBlock(term.factor.get(), term.loss, at.data(), term.factor->blocks());
  }
}

void AddPrior(PriorResidual* residual, const Prior& prior, Workspace* workspace,
              ceres::Problem* problem) {
  std::vector<double*> at;
  for (double* block : prior.blocks) at.push_back(workspace->At(block));
  problem->AddResidualBlock(residual, nullptr, at);
}

ceres::Solver::Options CeresOptions(const ceres::Problem& problem, const SolverOptions& options) {
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
    if (landmark && !problem.IsParameterBlockConstant(block)) {
      out.linear_solver_type = ceres::DENSE_SCHUR;
    }
  }
  if (out.linear_solver_type == ceres::DENSE_SCHUR) out.linear_solver_ordering = ordering;
  return out;
}

}  // namespace

SolverSummary Solve(std::vector<Term>* terms, const Prior& prior,
                    const std::function<bool(const double*)>& is_constant,
                    const SolverOptions& options) {
  PriorResidual prior_residual(&prior);
  Workspace workspace = Gather(*terms, prior);
  ceres::Problem problem(BorrowEverything());
  AddBlocks(is_constant, &workspace, &problem);
  AddTerms(terms, &workspace, &problem);
  if (!prior.empty()) AddPrior(&prior_residual, prior, &workspace, &problem);
  ceres::Solver::Summary summary;
  ceres::Solve(CeresOptions(problem, options), &problem, &summary);
  if (summary.IsSolutionUsable()) workspace.CopyBack();
  return {summary.IsSolutionUsable(), static_cast<int>(summary.iterations.size()),
          summary.final_cost};
}

}  // namespace slcmap
