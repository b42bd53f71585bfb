// Which manifold a parameter block lives on. Blocks of a kind are told by their size:
//
//   1 heading, 2 structural line, 3 point, 5 general line, 7 pose, 9 speed and bias
#pragma once

#include <ceres/manifold.h>

namespace slcmap {

// The manifold of blocks of this size; null where they are perturbed by addition. Shared by all
// blocks: it has no state.
ceres::Manifold* ManifoldOf(int block_size);

// The number of tangent dimensions of a block.
int TangentSize(int block_size);

// The block at x, moved by a tangent vector.
void BlockPlus(int block_size, const double* x, const double* delta, double* x_plus_delta);

// The tangent vector y minus x of two blocks of a kind.
void BlockMinus(int block_size, const double* y, const double* x, double* y_minus_x);

// A residual's Jacobian by the numbers of the block at x, from that by its tangent. Both are
// row-major, rows x TangentSize(block_size) and rows x block_size.
void JacobianByBlock(int block_size, const double* x, int rows, const double* by_tangent,
                     double* by_block);

}  // namespace slcmap
