#include "odometry/structure/line_classifier.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "odometry/structure/interpretation_plane.h"

namespace slcmap {
namespace {

// How far a line is from a direction.
struct Misfit {
  double angle_rad = 0;
  double sigmas = 0;
};

// The class of the one direction that fits. misfit: Misfit(const Eigen::Vector3d& d_world).
template <typename MisfitOf>
std::optional<LineClass> OnlyFit(const LineClassifierOptions& options,
                                 const std::vector<double>& headings_rad, const MisfitOf& misfit) {
  std::optional<LineClass> best;
  double best_sigmas = std::numeric_limits<double>::infinity();
  int possible = 0;
  for (const StructuralDirection& direction : StructuralDirections(headings_rad)) {
    const Misfit m = misfit(direction.d_world);
    if (m.sigmas < options.min_other_sigmas) ++possible;
    if (m.sigmas > options.max_sigmas || m.angle_rad > options.max_angle_rad) continue;
    if (m.sigmas >= best_sigmas) continue;
    best = direction.line_class;
    best_sigmas = m.sigmas;
  }
  return possible == 1 ? best : std::nullopt;
}

}  // namespace

std::vector<StructuralDirection> StructuralDirections(const std::vector<double>& headings_rad) {
  std::vector<StructuralDirection> out = {{{LineAxis::kVertical, -1}, Eigen::Vector3d::UnitZ()}};
  for (size_t i = 0; i < headings_rad.size(); ++i) {
    const double c = std::cos(headings_rad[i]), s = std::sin(headings_rad[i]);
    out.push_back({{LineAxis::kX, static_cast<int>(i)}, {c, s, 0}});
    out.push_back({{LineAxis::kY, static_cast<int>(i)}, {-s, c, 0}});
  }
  return out;
}

LineClassifier::LineClassifier(const LineClassifierOptions& options, double focal_px)
    : options_(options), end_sigma_(options.end_sigma_px / focal_px) {
  options_.Check();
}

std::optional<LineClass> LineClassifier::Classify(const LineSegment& segment,
                                                  const Eigen::Matrix3d& R_world_camera,
                                                  const std::vector<double>& headings_rad) const {
  const InterpretationPlane plane = PlaneOfSegment(segment, end_sigma_).Rotated(R_world_camera);
  return OnlyFit(options_, headings_rad, [&](const Eigen::Vector3d& d_world) {
    const VanishingAngle v = AngleToVanishingPoint(plane, d_world, options_.direction_sigma_rad);
    return Misfit{v.angle_rad, v.angle_rad / v.sigma_rad};
  });
}

std::optional<LineClass> LineClassifier::ClassifyDirection(
    const Eigen::Vector3d& d_world, const Eigen::Matrix3d& covariance,
    const std::vector<double>& headings_rad) const {
  const double axis_variance = options_.direction_sigma_rad * options_.direction_sigma_rad;
  return OnlyFit(options_, headings_rad, [&](const Eigen::Vector3d& axis) {
    Eigen::Matrix<double, 3, 2> across;
    across.col(0) = axis.unitOrthogonal();
    across.col(1) = axis.cross(across.col(0));
    const Eigen::Vector2d error = across.transpose() * d_world;
    const Eigen::Matrix2d variance =
        across.transpose() * covariance * across + axis_variance * Eigen::Matrix2d::Identity();
    const double angle_rad = std::atan2(error.norm(), std::abs(axis.dot(d_world)));
    return Misfit{angle_rad, std::sqrt(error.dot(variance.inverse() * error))};
  });
}

}  // namespace slcmap
