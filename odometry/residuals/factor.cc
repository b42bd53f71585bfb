#include "odometry/residuals/factor.h"

#include <algorithm>

namespace slcmap {
namespace {

constexpr int kMaxRows = 15;
constexpr int kMaxTangent = 9;

}  // namespace

Factor::Factor(int rows, const std::vector<BlockKind>& kinds) {
  set_num_residuals(rows);
  std::copy(kinds.begin(), kinds.end(), kinds_.begin());
  for (const BlockKind& kind : kinds) mutable_parameter_block_sizes()->push_back(kind.size);
}

void Factor::Linearize(const double* const* parameters, double* residuals,
                       double** jacobians) const {
  std::array<const double*, kMaxBlocks> at;
  bool moved = false;
  for (int k = 0; k < blocks(); ++k) {
    at[k] = linearization_[k] ? linearization_[k] : parameters[k];
    moved = moved || linearization_[k];
  }
  if (!jacobians || !moved) {
    EvaluateAt(parameters, residuals, jacobians);
    return;
  }
  std::array<double, kMaxRows> unused;
  EvaluateAt(at.data(), unused.data(), jacobians);
  EvaluateAt(parameters, residuals, nullptr);
}

bool Factor::Evaluate(const double* const* parameters, double* residuals,
                      double** jacobians) const {
  if (!jacobians) {
    EvaluateAt(parameters, residuals, nullptr);
    return true;
  }
  std::array<double, kMaxBlocks * kMaxRows * kMaxTangent> buffer;
  std::array<double*, kMaxBlocks> tangent{};
  for (int k = 0; k < blocks(); ++k) {
    if (!jacobians[k]) continue;
    tangent[k] = kinds_[k].manifold ? buffer.data() + k * kMaxRows * kMaxTangent : jacobians[k];
  }
  Linearize(parameters, residuals, tangent.data());
  for (int k = 0; k < blocks(); ++k) {
    if (tangent[k] == jacobians[k]) continue;
    JacobianByBlock(kinds_[k], parameters[k], rows(), tangent[k], jacobians[k]);
  }
  return true;
}

}  // namespace slcmap
