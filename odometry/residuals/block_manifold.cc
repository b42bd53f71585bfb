#include "odometry/residuals/block_manifold.h"

#include <algorithm>
#include <functional>

#include "odometry/residuals/line_manifold.h"
#include "odometry/residuals/pose_manifold.h"

namespace slcmap {
namespace {

template <int kSize, int kTangent>
void Carry(const double* x, int rows, const double* by_tangent, double* by_block) {
  Eigen::Matrix<double, kTangent, kSize, Eigen::RowMajor> minus;
  ManifoldOf(kSize)->MinusJacobian(x, minus.data());
  using ByTangent = Eigen::Matrix<double, Eigen::Dynamic, kTangent, Eigen::RowMajor>;
  using ByBlock = Eigen::Matrix<double, Eigen::Dynamic, kSize, Eigen::RowMajor>;
  Eigen::Map<ByBlock>(by_block, rows, kSize).noalias() =
      Eigen::Map<const ByTangent>(by_tangent, rows, kTangent).lazyProduct(minus);
}

}  // namespace

ceres::Manifold* ManifoldOf(int block_size) {
  static PoseManifold pose;
  static OrthonormalLineManifold line;
  if (block_size == kPoseSize) return &pose;
  if (block_size == kGeneralLineSize) return &line;
  return nullptr;
}

int TangentSize(int block_size) {
  if (block_size == kPoseSize) return kPoseTangentSize;
  if (block_size == kGeneralLineSize) return kGeneralLineTangentSize;
  return block_size;
}

void BlockPlus(int block_size, const double* x, const double* delta, double* x_plus_delta) {
  if (const ceres::Manifold* manifold = ManifoldOf(block_size)) {
    manifold->Plus(x, delta, x_plus_delta);
  } else {
    std::transform(x, x + block_size, delta, x_plus_delta, std::plus<>());
  }
}

void BlockMinus(int block_size, const double* y, const double* x, double* y_minus_x) {
  if (const ceres::Manifold* manifold = ManifoldOf(block_size)) {
    manifold->Minus(y, x, y_minus_x);
  } else {
    std::transform(y, y + block_size, x, y_minus_x, std::minus<>());
  }
}

void JacobianByBlock(int block_size, const double* x, int rows, const double* by_tangent,
                     double* by_block) {
  if (block_size == kPoseSize) {
    Carry<kPoseSize, kPoseTangentSize>(x, rows, by_tangent, by_block);
  } else if (block_size == kGeneralLineSize) {
    Carry<kGeneralLineSize, kGeneralLineTangentSize>(x, rows, by_tangent, by_block);
  } else {
    std::copy_n(by_tangent, rows * block_size, by_block);
  }
}

}  // namespace slcmap
