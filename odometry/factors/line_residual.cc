#include "odometry/factors/line_residual.h"

#include <cmath>

namespace slcmap::inline odometry {
namespace {

using Eigen::Map;
using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix23d = Eigen::Matrix<double, 2, 3>;
template <int kColumns>
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, kColumns, Eigen::RowMajor>;

// The sine of the angle between the plane of the line and that of the image below which the line's
// image is taken to be at infinity.
constexpr double kMinSine = 1e-6;
constexpr double kNoImageResidual = 10;  // standard deviations

// A line of the world in Pluecker coordinates about an anchor, up to scale: for a point p of it,
// moment = (p - anchor) x direction.
struct PlueckerLine {
  Eigen::Vector3d anchor_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();
};

// Derivatives of a Pluecker line by up to four parameters, a column each.
struct PlueckerJacobian {
  using Columns = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, 4>;
  Columns moment, direction;
};

// A line's residuals by the pose (dp, dtheta), by the camera calibration (psi, s, d) and by the
// parameters of its Pluecker Jacobian.
struct LineReprojectionJacobian {
  Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor, 4, 6> by_pose;
  Eigen::Matrix<double, Eigen::Dynamic, kCameraCalibrationSize, Eigen::RowMajor, 4,
                kCameraCalibrationSize>
      by_cameras;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, 4, 4> by_line;
};

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
        lens(cameras ? GetLens(camera, cameras) : geometry.lenses[camera]),
        centre_imu(geometry.T_imu_camera[camera].translation),
        from_centre(line.anchor_world - Map<const Vector3d>(pose) - R_world_imu * centre_imu),
        normal_imu(R_world_imu.transpose() * (line.moment + from_centre.cross(line.direction))) {
    if (!cameras || camera != 1) return;
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

// By its place among those of the measurement: left, right.
const LineSegment& GetSegment(const StereoLineMeasurement& measurement, int place) {
  return place == 0 ? measurement.left : *measurement.right;
}

// As the header has it; the Jacobian where it is wanted.
void ReprojectLine(const StereoGeometry& geometry, const StereoLineMeasurement& measurement,
                   const double* pose, const double* cameras, const PlueckerLine& line,
                   const PlueckerJacobian& line_jacobian, double* residuals,
                   LineReprojectionJacobian* jacobian) {
  const double weight = geometry.weight * measurement.weight;
  if (jacobian) {
    jacobian->by_pose.resize(measurement.rows(), 6);
    jacobian->by_cameras.setZero(measurement.rows(), kCameraCalibrationSize);
    jacobian->by_line.resize(measurement.rows(), line_jacobian.moment.cols());
  }
  for (int c = 0; 2 * c < measurement.rows(); ++c) {
    const int camera = measurement.camera + c;
    const LinePlane plane(geometry, camera, pose, cameras, line);
    const EndDistances ends =
        Distances(plane.NormalInCamera(),
                  LensEnds(GetSegment(measurement, c), camera, geometry, plane.lens), weight);
    Map<Vector2d>{residuals + 2 * c} = ends.residual;
    if (!jacobian) continue;
    const Matrix23d& by_normal = ends.jacobian;
    const Matrix23d by_imu = by_normal * plane.R_imu_camera.transpose();
    const Matrix23d by_world = by_imu * plane.R_world_imu.transpose();
    const Vector3d direction_imu = plane.R_world_imu.transpose() * line.direction;
    if (cameras) {
      // Exp(-psi) n moves by [n']x Jr(psi).
      const Vector3d n = plane.NormalInCamera();
      if (camera == 1) {
        jacobian->by_cameras.block<2, 3>(2 * c, kRowRightRotation) =
            by_normal * Skew(n) * RightJacobian(Map<const Vector3d>(cameras + kRowRightRotation));
        jacobian->by_cameras.block<2, 2>(2 * c, kRowRightCentre) = ends.by_centre;
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

// Of a line's residual: `make` gives the line and its Jacobian, where that is wanted, and `by_line`
// takes the derivatives by its numbers. The pose comes first, the cameras, where they are bound,
// next.
template <typename Make, typename ByLine>
void EvaluateReprojection(const StereoGeometry& geometry, const StereoLineMeasurement& measurement,
                          bool binds_cameras, const double* const* parameters, double* residuals,
                          double** jacobians, const Make& make, const ByLine& by_line) {
  const double* cameras = binds_cameras ? parameters[1] : nullptr;
  PlueckerJacobian by_parameters;
  const PlueckerLine line = make(jacobians ? &by_parameters : nullptr);
  LineReprojectionJacobian d;
  ReprojectLine(geometry, measurement, parameters[0], cameras, line, by_parameters, residuals,
                jacobians ? &d : nullptr);
  if (!jacobians) return;
  const int rows = measurement.rows();
  if (jacobians[0]) Map<RowMajor<6>>(jacobians[0], rows, 6) = d.by_pose;
  if (cameras && jacobians[1]) {
    Map<RowMajor<kCameraCalibrationSize>>(jacobians[1], rows, kCameraCalibrationSize) =
        d.by_cameras;
  }
  by_line(d.by_line);
}

// The line in Pluecker coordinates, scaled by rho so that one at infinity is nothing special. Where
// wanted, its derivatives by (heading, theta, rho). The heading is null for vertical lines.
PlueckerLine Pluecker(const StructuralLine& line, const double* heading, const double* block,
                      PlueckerJacobian* jacobian) {
  const double heading_rad = heading ? *heading : 0;
  const Vector3d axis = AxisDirection(line.axis, heading_rad);
  const Matrix32d across = AxesAcross(line.axis, heading_rad);
  const double c = std::cos(block[0]), s = std::sin(block[0]), rho = block[1];
  const PlueckerLine out{line.anchor_world, (across * Vector2d(c, s)).cross(axis), rho * axis};
  if (jacobian) {
    const Vector3d up = Vector3d::UnitZ();
    jacobian->moment.resize(3, 3);
    jacobian->direction.resize(3, 3);
    if (line.HasHeading()) {
      jacobian->moment.col(0) = up.cross(out.moment);
      jacobian->direction.col(0) = up.cross(out.direction);
    } else {
      jacobian->moment.col(0).setZero();
      jacobian->direction.col(0).setZero();
    }
    jacobian->moment.col(1) = (across * Vector2d(-s, c)).cross(axis);
    jacobian->direction.col(1).setZero();
    jacobian->moment.col(2).setZero();
    jacobian->direction.col(2) = axis;
  }
  return out;
}

std::vector<BlockKind> CollectKinds(const StructuralLine& line, bool binds_cameras) {
  std::vector<BlockKind> kinds{kPoseKind};
  if (binds_cameras) kinds.push_back(kCameraCalibrationKind);
  if (line.HasHeading()) kinds.push_back(kHeadingKind);
  kinds.push_back(kStructuralLineKind);
  return kinds;
}

}  // namespace

StructuralLineResidual::StructuralLineResidual(const StereoGeometry* geometry,
                                               const StructuralLine& line,
                                               const StereoLineMeasurement& measurement,
                                               bool binds_cameras)
    : Factor(measurement.rows(), CollectKinds(line, binds_cameras)),
      geometry_(geometry),
      line_(line),
      measurement_(measurement),
      binds_cameras_(binds_cameras) {}

void StructuralLineResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                        double** jacobians) const {
  const int last = blocks() - 1, heading_at = last - 1;
  const double* heading = line_.HasHeading() ? parameters[heading_at] : nullptr;
  EvaluateReprojection(
      *geometry_, measurement_, binds_cameras_, parameters, residuals, jacobians,
      [&](PlueckerJacobian* by_parameters) {
        return Pluecker(line_, heading, parameters[last], by_parameters);
      },
      [&](const auto& by_line) {
        if (heading && jacobians[heading_at]) {
          Map<Eigen::VectorXd>(jacobians[heading_at], rows()) = by_line.col(0);
        }
        if (jacobians[last]) {
          Map<RowMajor<2>>(jacobians[last], rows(), 2) = by_line.template rightCols<2>();
        }
      });
}

namespace {

// The line in Pluecker coordinates and, where wanted, its derivatives by the block's tangent.
PlueckerLine Pluecker(const Vector3d& anchor_world, const double* block,
                      PlueckerJacobian* jacobian) {
  const Matrix3d u = Eigen::Map<const Eigen::Quaterniond>(block).toRotationMatrix();
  const double c = std::cos(block[4]), s = std::sin(block[4]);
  if (jacobian) {
    // U <- U Exp(d): u_k changes by u_j d_i - u_i d_j for the cyclic (i, j, k).
    const Vector3d zero = Vector3d::Zero();
    jacobian->moment.resize(3, 4);
    jacobian->direction.resize(3, 4);
    jacobian->moment << zero, -c * u.col(2), c * u.col(1), -s * u.col(0);
    jacobian->direction << s * u.col(2), zero, -s * u.col(0), c * u.col(1);
  }
  return {anchor_world, c * u.col(0), s * u.col(1)};
}

}  // namespace

GeneralLineResidual::GeneralLineResidual(const StereoGeometry* geometry,
                                         const Vector3d& anchor_world,
                                         const StereoLineMeasurement& measurement,
                                         bool binds_cameras)
    : Factor(measurement.rows(),
             binds_cameras
                 ? std::vector<BlockKind>{kPoseKind, kCameraCalibrationKind, kGeneralLineKind}
                 : std::vector<BlockKind>{kPoseKind, kGeneralLineKind}),
      geometry_(geometry),
      anchor_world_(anchor_world),
      measurement_(measurement) {}

void GeneralLineResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                     double** jacobians) const {
  const int last = blocks() - 1;
  EvaluateReprojection(
      *geometry_, measurement_, last == 2, parameters, residuals, jacobians,
      [&](PlueckerJacobian* by_tangent) {
        return Pluecker(anchor_world_, parameters[last], by_tangent);
      },
      [&](const auto& by_line) {
        if (jacobians[last]) Map<RowMajor<4>>(jacobians[last], rows(), 4) = by_line;
      });
}

}  // namespace slcmap::odometry
