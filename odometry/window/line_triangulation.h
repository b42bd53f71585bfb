// Lines in 3D from everything that has seen them, with the poses as they are.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "odometry/factors/line_residual.h"
#include "odometry/geometry/lines.h"
#include "odometry/window/options.h"

namespace slcmap::inline odometry {

// One stereo pair that saw a line.
struct PosedLineObservation {
  RigidTransform T_world_imu;
  StereoLineMeasurement measurement;
};

struct StructuralLineFit {
  StructuralLineBlock block;
  Eigen::Matrix2d covariance;  // of the block (rad, 1 / m)
};

// The structural line that fits its observations best: the point in which the planes through its
// axis and the middles of the segments meet (SLC-VIO, section 3.6), then Gauss-Newton on the
// reprojections with a robust loss. Nothing where its place is not known well enough or it lies
// behind a camera. How well it fits is for the caller to judge.
std::optional<StructuralLineFit> TriangulateStructuralLine(
    const std::vector<PosedLineObservation>& observations, const StructuralLine& line,
    double heading_rad, const StereoGeometry& geometry, const LineTriangulationOptions& options);

struct GeneralLineFit {
  GeneralLineBlock block;
  Eigen::Matrix4d covariance;            // of the block's tangent (rad)
  Eigen::Matrix3d direction_covariance;  // of the unit direction in the world, rank 2
};

// The same for a line of any direction: first that in which the planes of the segments meet.
std::optional<GeneralLineFit> TriangulateGeneralLine(
    const std::vector<PosedLineObservation>& observations, const Eigen::Vector3d& anchor_world,
    const StereoGeometry& geometry, const LineTriangulationOptions& options);

// From where to where on a line a camera saw it: the points of it nearest to the rays of the
// segment's ends (on the plane z = 1), in metres from the line's point along its direction, the
// smaller first. Nothing where a ray meets the line behind the camera or nearly along it.
std::optional<std::pair<double, double>> ExtentAlong(const PointAndDirection& line,
                                                     const LineSegment& segment,
                                                     const RigidTransform& T_world_camera);

}  // namespace slcmap::odometry
