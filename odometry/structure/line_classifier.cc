#include "odometry/structure/line_classifier.h"

#include <cmath>
#include <limits>

#include "odometry/structure/interpretation_plane.h"

namespace slcmap {

std::vector<StructuralDirection> StructuralDirections(
    const std::vector<std::optional<double>>& headings_rad) {
  std::vector<StructuralDirection> out = {{{LineAxis::kVertical, -1}, Eigen::Vector3d::UnitZ()}};
  for (size_t i = 0; i < headings_rad.size(); ++i) {
    if (!headings_rad[i]) continue;
    const double c = std::cos(*headings_rad[i]), s = std::sin(*headings_rad[i]);
    out.push_back({{LineAxis::kX, static_cast<int>(i)}, {c, s, 0}});
    out.push_back({{LineAxis::kY, static_cast<int>(i)}, {-s, c, 0}});
  }
  return out;
}

LineClassifier::LineClassifier(const LineClassifierOptions& options, double focal_px)
    : options_(options), end_sigma_(options.end_sigma_px / focal_px) {
  options_.Check();
}

std::optional<LineClass> LineClassifier::Classify(
    const LineSegment& segment, const Eigen::Matrix3d& R_world_camera,
    const std::vector<std::optional<double>>& headings_rad) const {
  const InterpretationPlane plane = PlaneOfSegment(segment, end_sigma_).Rotated(R_world_camera);
  std::optional<LineClass> best;
  double best_sigmas = std::numeric_limits<double>::infinity();
  int possible = 0;
  for (const StructuralDirection& direction : StructuralDirections(headings_rad)) {
    const VanishingAngle v =
        AngleToVanishingPoint(plane, direction.d_world, options_.direction_sigma_rad);
    const double sigmas = v.angle_rad / v.sigma_rad;
    if (sigmas < options_.min_other_sigmas) ++possible;
    if (sigmas > options_.max_sigmas || v.angle_rad > options_.max_angle_rad) continue;
    if (sigmas >= best_sigmas) continue;
    best = direction.line_class;
    best_sigmas = sigmas;
  }
  return possible == 1 ? best : std::nullopt;
}

}  // namespace slcmap
