#include "mapping/dense/depth_confirmation.h"

#include <algorithm>
#include <cmath>

namespace slcmap {
namespace {

constexpr double kContrarySigmas = 3;
constexpr double kFloor = 0.008;  // of inverse depth, as a share: planes bend between nodes

enum class Opinion { kNone, kAgrees, kContradicts };

class Confirmer {
 public:
  Confirmer(const PlacedGrid& view, const std::vector<PlacedGrid>& others, const Camera& camera,
            const DenseOptions& options)
      : others_(others), camera_(camera), options_(options) {
    for (const PlacedGrid& other : others) {
      T_other_view_.push_back(other.T_world_camera.Inverse() * view.T_world_camera);
    }
  }

  bool IsConfirmed(int u, int v, const DepthNode& node) const {
    const Eigen::Vector3d p_view = node.depth_m() * PinholeRay(camera_, u, v);
    std::vector<Eigen::Vector3d> places = {Eigen::Vector3d::Zero()};  // of views that agree
    int contrary = 0;
    for (std::size_t i = 0; i < others_.size(); ++i) {
      const Opinion opinion = Ask(i, p_view, node);
      if (opinion == Opinion::kContradicts) ++contrary;
      if (opinion != Opinion::kAgrees) continue;
      const Eigen::Vector3d place = T_other_view_[i].Inverse().translation;
      const bool is_apart = std::all_of(places.begin(), places.end(), [&](const auto& other) {
        return (place - other).norm() >= options_.min_baseline_m;
      });
      if (is_apart) places.push_back(place);
    }
    const int agreeing = static_cast<int>(places.size());
    return agreeing >= options_.min_views && agreeing > contrary;
  }

 private:
  Opinion Ask(std::size_t other, const Eigen::Vector3d& p_view, const DepthNode& node) const {
    const Eigen::Vector3d p = T_other_view_[other] * p_view;
    if (p.z() < options_.min_depth_m) return Opinion::kNone;
    const Eigen::Vector2d pixel_px(camera_.fx_px * p.x() / p.z() + camera_.cx_px,
                                   camera_.fy_px * p.y() / p.z() + camera_.cy_px);
    Eigen::Vector2d offset_px;
    const DepthNode* seen = others_[other].grid->KnownNear(pixel_px, &offset_px);
    if (!seen) return Opinion::kNone;
    const double seen_inverse =
        seen->inverse_depth + offset_px.x() * seen->slope_x + offset_px.y() * seen->slope_y;
    const double inverse = 1 / p.z();
    // A displacement along the view's ray moves the point about as much in depth of the other one.
    const double sigma = node.sigma * std::pow(inverse / node.inverse_depth, 2);
    const double floor = kFloor * inverse;
    const double both = std::sqrt(sigma * sigma + seen->sigma * seen->sigma + floor * floor);
    if (std::abs(seen_inverse - inverse) <= options_.agree_sigmas * both) return Opinion::kAgrees;
    return seen_inverse < inverse - kContrarySigmas * both ? Opinion::kContradicts : Opinion::kNone;
  }

  const std::vector<PlacedGrid>& others_;
  const Camera& camera_;
  const DenseOptions& options_;
  std::vector<RigidTransform> T_other_view_;
};

}  // namespace

DepthGrid ConfirmedDepth(const PlacedGrid& view, const std::vector<PlacedGrid>& others,
                         const Camera& camera, const DenseOptions& options) {
  const Confirmer confirmer(view, others, camera, options);
  DepthGrid confirmed = *view.grid;
  for (int row = 0; row < confirmed.rows; ++row) {
    for (int column = 0; column < confirmed.columns; ++column) {
      DepthNode& node = confirmed.At(column, row);
      if (!node.is_known()) continue;
      if (!confirmer.IsConfirmed(confirmed.ColumnPixel(column), confirmed.RowPixel(row), node)) {
        node.inverse_depth = 0;
      }
    }
  }
  return confirmed;
}

}  // namespace slcmap
