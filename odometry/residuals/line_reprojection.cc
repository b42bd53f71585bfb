#include "odometry/residuals/line_reprojection.h"

namespace slcmap {
namespace {

using Eigen::Map;
using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix23d = Eigen::Matrix<double, 2, 3>;

// The sine of the angle between the plane of the line and that of the image below which the line's
// image is taken to be at infinity.
constexpr double kMinSine = 1e-6;
constexpr double kNoImageResidual = 10;  // standard deviations

struct EndDistances {
  Vector2d residual = Vector2d::Constant(kNoImageResidual);
  Matrix23d jacobian = Matrix23d::Zero();  // d residual / d n
  Vector2d by_focal_length = Vector2d::Zero();
  Matrix2d by_centre = Matrix2d::Zero();
};

// Of a segment's ends, by the lens, and how they move with it.
struct LensEnds {
  LensEnds(const LineSegment& segment, int camera, const StereoGeometry& geometry,
           const LensCorrection& correction)
      : lens(correction),
        ends{LensMeasurement(geometry, camera, segment.start),
             LensMeasurement(geometry, camera, segment.end)} {}

  LensCorrection lens;
  std::array<LensMeasurement, 2> ends;
};

EndDistances Distances(const Vector3d& n, const LensEnds& segment, double weight) {
  EndDistances out;
  const double m = n.head<2>().norm();
  if (!(m > kMinSine * n.norm())) return out;
  const Vector3d flat(n.x() / m, n.y() / m, 0);
  const double s = segment.lens.focal_length;
  for (int end = 0; end < 2; ++end) {
    const LensMeasurement& measured = segment.ends[end];
    const Vector3d at = measured.At(segment.lens).homogeneous();
    const double distance = at.dot(n) / m;
    // Across the line, as a point's.
    const double gradient = flat.head<2>().dot(measured.gradient * flat.head<2>());
    const double scale = weight * (1 + s * gradient);
    out.residual[end] = scale * distance;
    out.jacobian.row(end) = (scale / m) * (at - distance * flat).transpose();
    out.by_focal_length[end] =
        weight * gradient * distance + scale * flat.head<2>().dot(measured.ByFocalLength(s));
    out.by_centre.row(end) = -scale * flat.head<2>().transpose() * measured.by_centre;
  }
  return out;
}

// The plane of a line through a camera's centre, by its normal.
struct LinePlane {
  LinePlane(const StereoGeometry& geometry, int camera, const double* pose, const double* cameras,
            const PlueckerLine& line)
      : R_world_imu(Map<const Quaterniond>(pose + 3).toRotationMatrix()),
        R_imu_camera(geometry.R_imu_camera[camera]),
        lens(cameras ? LensOf(camera, cameras) : geometry.lenses[camera]),
        centre_imu(geometry.T_imu_camera[camera].translation),
        from_centre(line.anchor_world - Map<const Vector3d>(pose) - R_world_imu * centre_imu),
        normal_imu(R_world_imu.transpose() * (line.moment + from_centre.cross(line.direction))) {
    if (!cameras || camera == 0) return;
    R_imu_camera = R_imu_camera * RightRotation(cameras).toRotationMatrix();
  }

  Vector3d NormalInCamera() const { return R_imu_camera.transpose() * normal_imu; }

  Matrix3d R_world_imu;
  Matrix3d R_imu_camera;
  LensCorrection lens;
  const Vector3d& centre_imu;
  Vector3d from_centre;  // to the anchor, in the world
  Vector3d normal_imu;
};

const LineSegment& SegmentOf(const StereoLineMeasurement& measurement, int camera) {
  return camera == 0 ? measurement.left : *measurement.right;
}

}  // namespace

void EvaluateLineReprojection(const StereoGeometry& geometry,
                              const StereoLineMeasurement& measurement, const double* pose,
                              const double* cameras, const PlueckerLine& line, double* residuals) {
  const double weight = geometry.weight * measurement.weight;
  for (int c = 0; 2 * c < measurement.rows(); ++c) {
    const LinePlane plane(geometry, c, pose, cameras, line);
    Map<Vector2d>{residuals + 2 * c} =
        Distances(plane.NormalInCamera(),
                  LensEnds(SegmentOf(measurement, c), c, geometry, plane.lens), weight)
            .residual;
  }
}

void LinearizeLineReprojection(const StereoGeometry& geometry,
                               const StereoLineMeasurement& measurement, const double* pose,
                               const double* cameras, const PlueckerLine& line,
                               const PlueckerJacobian& line_jacobian, double* residuals,
                               LineReprojectionJacobian* jacobian) {
  const double weight = geometry.weight * measurement.weight;
  jacobian->by_pose.resize(measurement.rows(), 6);
  jacobian->by_cameras.setZero(measurement.rows(), kCameraCalibrationSize);
  jacobian->by_line.resize(measurement.rows(), line_jacobian.moment.cols());
  for (int c = 0; 2 * c < measurement.rows(); ++c) {
    const LinePlane plane(geometry, c, pose, cameras, line);
    const EndDistances ends =
        Distances(plane.NormalInCamera(),
                  LensEnds(SegmentOf(measurement, c), c, geometry, plane.lens), weight);
    Map<Vector2d>{residuals + 2 * c} = ends.residual;
    const Matrix23d& by_normal = ends.jacobian;
    const Matrix23d by_imu = by_normal * plane.R_imu_camera.transpose();
    const Matrix23d by_world = by_imu * plane.R_world_imu.transpose();
    const Vector3d direction_imu = plane.R_world_imu.transpose() * line.direction;
    if (cameras) {
      // Exp(-psi) n moves by [n']x Jr(psi).
      const Vector3d n = plane.NormalInCamera();
      if (c == 1) {
        jacobian->by_cameras.block<2, 3>(2, kRowRightRotation) =
            by_normal * Skew(n) * RightJacobian(Map<const Vector3d>(cameras + kRowRightRotation));
        jacobian->by_cameras.block<2, 2>(2, kRowRightCentre) = ends.by_centre;
      }
      jacobian->by_cameras.block<2, 1>(2 * c, kRowFocalLength) = ends.by_focal_length;
    }
    jacobian->by_pose.block<2, 3>(2 * c, 0) = by_world * Skew(line.direction);
    jacobian->by_pose.block<2, 3>(2 * c, 3) =
        by_imu * (Skew(plane.normal_imu) - Skew(direction_imu) * Skew(plane.centre_imu));
    jacobian->by_line.middleRows<2>(2 * c) =
        by_world * (line_jacobian.moment + Skew(plane.from_centre) * line_jacobian.direction);
  }
}

}  // namespace slcmap
