#include "odometry/residuals/prior.h"

namespace slcmap {

int Prior::TangentOffset(int block) const {
  int offset = 0;
  for (int k = 0; k < block; ++k) offset += kinds[k].tangent_size;
  return offset;
}

int Prior::TangentTotal() const { return TangentOffset(static_cast<int>(blocks.size())); }

Eigen::VectorXd Prior::Difference(const double* const* parameters) const {
  Eigen::VectorXd d(TangentTotal());
  int offset = 0;
  for (size_t k = 0; k < blocks.size(); ++k) {
    BlockMinus(kinds[k], parameters[k], x_lin[k].data(), d.data() + offset);
    offset += kinds[k].tangent_size;
  }
  return d;
}

}  // namespace slcmap
