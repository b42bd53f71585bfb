#include "odometry/residuals/block_kind.h"

#include <Eigen/Core>
#include <algorithm>
#include <functional>

namespace slcmap {

ceres::Manifold* SharedPoseManifold() {
  static PoseManifold manifold;
  return &manifold;
}

ceres::Manifold* SharedLineManifold() {
  static OrthonormalLineManifold manifold;
  return &manifold;
}

void BlockPlus(const BlockKind& kind, const double* x, const double* delta, double* x_plus_delta) {
  if (kind.manifold) {
    kind.manifold()->Plus(x, delta, x_plus_delta);
  } else {
    std::transform(x, x + kind.size, delta, x_plus_delta, std::plus<>());
  }
}

void BlockMinus(const BlockKind& kind, const double* y, const double* x, double* y_minus_x) {
  if (kind.manifold) {
    kind.manifold()->Minus(y, x, y_minus_x);
  } else {
    std::transform(y, y + kind.size, x, y_minus_x, std::minus<>());
  }
}

void JacobianByBlock(const BlockKind& kind, const double* x, int rows, const double* by_tangent,
                     double* by_block) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  if (!kind.manifold) {
    std::copy_n(by_tangent, rows * kind.size, by_block);
    return;
  }
  RowMajor minus(kind.tangent_size, kind.size);
  kind.manifold()->MinusJacobian(x, minus.data());
  Eigen::Map<RowMajor>(by_block, rows, kind.size).noalias() =
      Eigen::Map<const RowMajor>(by_tangent, rows, kind.tangent_size).lazyProduct(minus);
}

}  // namespace slcmap
