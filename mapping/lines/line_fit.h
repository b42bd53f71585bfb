// The line of the world that fits the places where images have its edge, and directions across a
// line.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "mapping/lines/line_samples.h"
#include "mapping/lines/options.h"
#include "mapping/views/view.h"

namespace slcmap::inline mapping {

// Along a line, over which samples of one image make one place: short, so that what runs askew of
// the line does not average out.
inline constexpr double kFitPlaceStep_m = 0.06;

// Two columns, square to the direction (of length 1) and to each other.
inline Eigen::Matrix<double, 3, 2> ComputeAcross(const Eigen::Vector3d& direction) {
  Eigen::Matrix<double, 3, 2> across;
  across.col(0) = direction.unitOrthogonal();
  across.col(1) = direction.cross(across.col(0));
  return across;
}

// The mean of some samples that are near each other on a line, in one image.
struct EdgePoint {
  int view = 0, camera = 0;
  float along_m = 0;
  Eigen::Vector2f px = Eigen::Vector2f::Zero();      // on the edge
  Eigen::Vector2f normal = Eigen::Vector2f::Zero();  // of the line's image
  int samples = 0;
  float from_m = 0, to_m = 0;  // of what the samples stand for
};

// Means of the samples that are edges over intervals of at most step_m, added to `places`.
void AddPlaces(const std::vector<LineSample>& samples, const LineInView& line, int view, int camera,
               double step_m, std::vector<EdgePoint>* places);

// How far from an axis of the building the direction of a line may be, or from the plane across an
// axis, as that of level lines.
struct DirectionPrior {
  Eigen::Vector3d axis_world;  // unit
  double sigma_rad = 0;
  bool is_across = false;
};

struct LineFit {
  PointAndDirection line;  // its point in the middle of the places
  // Of the place across the line at its point (m, first two) and of the direction (rad), along the
  // columns of `across`: against other lines, as if places erred each for itself, against the prior
  // too; and against the world, with what places of an image and what all views share.
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero(), world_covariance = Eigen::Matrix4d::Zero();
  Eigen::Matrix<double, 3, 2> across = Eigen::Matrix<double, 3, 2>::Zero();
  double rms_px = 0;
  // The same by the median of the places: few that are of another edge nearby do not count.
  double spread_px = 0;
  double shift_m = 0;  // of the point along the line, by which places' along_m became smaller
  int views = 0;       // left and right images of a view count once

  double sigma_m() const;  // across the line at its point, where that is largest
  // The same in a direction (unit), so far along the line from its point.
  double SigmaTowards_m(const Eigen::Vector3d& way_world, double along_m) const;
};

// Gauss-Newton from `start` on the distances of the places from the line's image, with Cauchy's
// loss; places are re-weighted in each step. Those that err alike in an image count as one against
// the prior. Nothing where they do not determine a line.
std::optional<LineFit> FitLine(const PointAndDirection& start, const std::vector<EdgePoint>& places,
                               const ViewCameras& views, const std::optional<DirectionPrior>& prior,
                               const LineFitOptions& options);

// The standard deviation of distances (at least 0) by their median.
double ComputeSpread(std::vector<double> distances_px);

// How far the places are off the line's image (px, at least 0; a large number behind a camera), in
// their order, whose along_m count from shift_m before the line's point.
std::vector<double> OffLine_px(const PointAndDirection& line, double shift_m,
                               const std::vector<EdgePoint>& places, const ViewCameras& views);

}  // namespace slcmap::mapping
