#include "odometry/residuals/principal_point_residual.h"

#include <algorithm>
#include <vector>

namespace slcmap {
namespace {

// Where the principal points stand among the blocks.
std::vector<BlockKind> KindsWith(const Factor& point) {
  std::vector<BlockKind> kinds;
  for (int k = 0; k < point.blocks(); ++k) kinds.push_back(point.kind(k));
  kinds.insert(kinds.end() - 1, kPrincipalPointKind);
  return kinds;
}

}  // namespace

Eigen::Matrix2d PlaneByPixel(const Camera& camera, const Eigen::Quaterniond& R_camera_rectified,
                             const Eigen::Vector2d& measured) {
  constexpr double kStep_px = 0.5;
  const auto pixel = camera.Project(R_camera_rectified * measured.homogeneous());
  if (!pixel) return Eigen::Matrix2d::Zero();
  const auto on_plane = [&](const Eigen::Vector2d& at) -> std::optional<Eigen::Vector2d> {
    const auto ray = camera.Unproject(at);
    if (!ray) return std::nullopt;
    const Eigen::Vector3d in_rectified = R_camera_rectified.conjugate() * *ray;
    if (in_rectified.z() <= 0) return std::nullopt;
    return in_rectified.hnormalized();
  };
  Eigen::Matrix2d by_pixel;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector2d step = kStep_px * Eigen::Vector2d::Unit(k);
    const auto after = on_plane(*pixel + step), before = on_plane(*pixel - step);
    if (!after || !before) return Eigen::Matrix2d::Zero();
    by_pixel.col(k) = (*after - *before) / (2 * kStep_px);
  }
  return by_pixel;
}

PrincipalPointResidual::PrincipalPointResidual(std::unique_ptr<Factor> point, double weight,
                                               const std::array<Eigen::Matrix2d, 2>& by_pixel)
    : Factor(point->rows(), KindsWith(*point)), point_(std::move(point)) {
  by_principal_.setZero(rows(), kPrincipalPointSize);
  for (int camera = 0; camera < rows() / 2; ++camera) {
    by_principal_.block<2, 2>(2 * camera, 2 * camera) = weight * by_pixel[camera];
  }
}

void PrincipalPointResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                        double** jacobians) const {
  const int own = blocks() - 2;
  std::array<const double*, kMaxBlocks> of_point{};
  std::array<double*, kMaxBlocks> by_block{};
  for (int k = 0; k < point_->blocks(); ++k) {
    of_point[k] = parameters[k < own ? k : k + 1];
    if (jacobians) by_block[k] = jacobians[k < own ? k : k + 1];
  }
  point_->Linearize(of_point.data(), residuals, jacobians ? by_block.data() : nullptr);
  const Eigen::Map<const Eigen::Vector4d> principal(parameters[own]);
  Eigen::Map<Eigen::VectorXd>(residuals, rows()) += by_principal_ * principal;
  if (!jacobians || !jacobians[own]) return;
  std::copy_n(by_principal_.data(), by_principal_.size(), jacobians[own]);
}

}  // namespace slcmap
