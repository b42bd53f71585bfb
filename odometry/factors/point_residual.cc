#include "odometry/factors/point_residual.h"

namespace slcmap::inline odometry {
namespace {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix23d = Eigen::Matrix<double, 2, 3>;

// A point nearer than this share of its host's distance is about to pass behind the target; it gets
// a constant residual, so that the solver neither fails on it nor gains by it.
constexpr double kMinDepthRatio = 0.02;
constexpr double kBehindResidual = 10;  // standard deviations

using Jacobian26 = Eigen::Matrix<double, 2, 6, Eigen::RowMajor>;
using JacobianByCameras = Eigen::Matrix<double, 2, kCameraCalibrationSize, Eigen::RowMajor>;
using Jacobian23 = Eigen::Matrix<double, 2, 3, Eigen::RowMajor>;

// The numbers of a camera calibration block.
struct CameraCalibration {
  explicit CameraCalibration(const double* block)
      : psi(block + kRowRightRotation),
        first(GetLens(0, block)),
        second(GetLens(1, block)),
        R_true_right(RightRotation(block).conjugate().toRotationMatrix()) {}

  const LensCorrection& lens(int camera) const { return camera == 1 ? second : first; }

  Eigen::Map<const Vector3d> psi;
  LensCorrection first, second;  // of all cameras but the second, and of that
  Matrix3d R_true_right;         // turns the given frame's coordinates into the true one's
};

std::array<LensMeasurement, 2> MakeLensMeasurements(const StereoMeasurement& measurement,
                                                    const StereoGeometry& geometry) {
  std::array<LensMeasurement, 2> out;
  out[0] = {geometry, measurement.camera, measurement.left};
  if (measurement.right) out[1] = {geometry, measurement.camera + 1, *measurement.right};
  return out;
}

// A point of a camera's given frame on its image.
struct Projection {
  Projection(const Vector3d& p_given, int camera, const CameraCalibration& calibration)
      : p_camera(camera == 1 ? calibration.R_true_right * p_given : p_given) {}

  bool IsInFront() const { return p_camera.z() >= kMinDepthRatio; }
  Vector2d OnPlane() const { return p_camera.head<2>() / p_camera.z(); }

  Vector2d Residual(const LensMeasurement& measured, double weight,
                    const LensCorrection& lens) const {
    if (!IsInFront()) return Vector2d::Constant(kBehindResidual);
    return weight * measured.Magnification(lens.focal_length) * (OnPlane() - measured.At(lens));
  }

  // Of the residual by p_camera.
  Matrix23d ByPoint(const LensMeasurement& measured, double weight,
                    const LensCorrection& lens) const {
    Matrix23d d = Matrix23d::Zero();
    if (!IsInFront()) return d;
    const double inverse_z = 1 / p_camera.z();
    const Vector2d on_plane = OnPlane();
    d << inverse_z, 0, -on_plane.x() * inverse_z, 0, inverse_z, -on_plane.y() * inverse_z;
    return weight * measured.Magnification(lens.focal_length) * d;
  }

  // Of the residual by the camera calibration, with ByPoint(). Exp(-psi) p moves by [p']x Jr(psi).
  JacobianByCameras ByCalibration(const Matrix23d& by_point, int camera, double weight,
                                  const LensMeasurement& measured,
                                  const CameraCalibration& calibration) const {
    JacobianByCameras d = JacobianByCameras::Zero();
    if (!IsInFront()) return d;
    const LensCorrection& lens = calibration.lens(camera);
    const double s = lens.focal_length;
    d.col(kRowFocalLength) = weight * (measured.gradient * (OnPlane() - measured.At(lens)) -
                                       measured.Magnification(s) * measured.ByFocalLength(s));
    if (camera != 1) return d;
    d.middleCols<3>(kRowRightRotation) = by_point * Skew(p_camera) * RightJacobian(calibration.psi);
    d.middleCols<2>(kRowRightCentre) = weight * measured.Magnification(s) * measured.by_centre;
    return d;
  }

  Vector3d p_camera;  // in the camera's true frame
};

}  // namespace

StereoGeometry::StereoGeometry(const std::vector<RigidTransform>& transforms, double w)
    : T_imu_camera(transforms), weight(w), lenses(transforms.size()) {
  for (const RigidTransform& pose : transforms) {
    R_imu_camera.push_back(pose.rotation.toRotationMatrix());
  }
}

StereoGeometry StereoGeometry::CorrectedBy(const double* cameras) const {
  std::vector<RigidTransform> transforms = T_imu_camera;
  transforms[1].rotation = (transforms[1].rotation * RightRotation(cameras)).normalized();
  StereoGeometry corrected(transforms, weight);
  corrected.lens_shifts = lens_shifts;
  for (size_t i = 0; i < transforms.size(); ++i) {
    corrected.lenses[i] = GetLens(static_cast<int>(i), cameras);
  }
  return corrected;
}

LensMeasurement::LensMeasurement(const StereoGeometry& geometry, int camera, const Vector2d& at)
    : measured(at),
      shift(geometry.GetShift(camera).ByFocalLength(at)),
      gradient(geometry.GetShift(camera).GradientAt(at)),
      by_centre(geometry.GetShift(camera).ByCentre(at)) {}

PointResidual::PointResidual(const StereoGeometry* geometry, const StereoMeasurement& target,
                             int host_camera)
    : Factor(target.right ? 4 : 2, {kPoseKind, kPoseKind, kCameraCalibrationKind, kPointKind}),
      geometry_(geometry),
      target_(MakeLensMeasurements(target, *geometry)),
      host_camera_(host_camera),
      first_camera_(target.camera),
      cameras_(target.right ? 2 : 1) {}

void PointResidual::EvaluateAt(const double* const* parameters, double* residuals,
                               double** jacobians) const {
  const Map<const Vector3d> p_h(parameters[0]), p_t(parameters[1]);
  const Matrix3d r_h = Map<const Quaterniond>(parameters[0] + 3).toRotationMatrix();
  const Matrix3d r_t_t = Map<const Quaterniond>(parameters[1] + 3).conjugate().toRotationMatrix();
  const CameraCalibration calibration(parameters[2]);
  const Vector3d ray(parameters[3][0], parameters[3][1], 1);
  const double lambda = parameters[3][2];
  const Matrix3d& r_ich = geometry_->R_imu_camera[host_camera_];
  const Vector3d& p_ich = geometry_->T_imu_camera[host_camera_].translation;
  const Vector3d in_host = r_ich * ray + lambda * p_ich;
  const Vector3d between = p_h - p_t;
  const Vector3d m = r_t_t * (r_h * in_host + lambda * between);
  for (int c = 0; c < cameras_; ++c) {
    const int camera = first_camera_ + c;
    const Matrix3d& r_ic = geometry_->R_imu_camera[camera];
    const Vector3d& p_ic = geometry_->T_imu_camera[camera].translation;
    const Projection projection(r_ic.transpose() * (m - lambda * p_ic), camera, calibration);
    Map<Vector2d>{residuals + 2 * c} =
        projection.Residual(target_[c], geometry_->weight, calibration.lens(camera));
    if (!jacobians) continue;
    const Matrix23d by_point =
        projection.ByPoint(target_[c], geometry_->weight, calibration.lens(camera));
    const Matrix23d by_given = camera == 1 ? by_point * calibration.R_true_right : by_point;
    const Matrix23d by_m = by_given * r_ic.transpose();
    const Matrix23d by_world = by_m * r_t_t;
    const Matrix23d by_host = by_world * r_h;
    if (jacobians[0]) {
      Map<Jacobian26> d(jacobians[0] + 12 * c);
      d.leftCols<3>() = lambda * by_world;
      d.rightCols<3>() = -by_host * Skew(in_host);
    }
    if (jacobians[1]) {
      Map<Jacobian26> d(jacobians[1] + 12 * c);
      d.leftCols<3>() = -lambda * by_world;
      d.rightCols<3>() = by_m * Skew(m);
    }
    if (jacobians[2]) {
      Map<JacobianByCameras>{jacobians[2] + 2 * kCameraCalibrationSize* c} =
          projection.ByCalibration(by_point, camera, geometry_->weight, target_[c], calibration);
    }
    if (jacobians[3]) {
      Map<Jacobian23> d(jacobians[3] + 6 * c);
      d.leftCols<2>() = by_host * r_ich.leftCols<2>();
      d.rightCols<1>() = by_host * p_ich + by_world * between - by_m * p_ic;
    }
  }
}

HostPointResidual::HostPointResidual(const StereoGeometry& geometry, const StereoMeasurement& host)
    : Factor(host.right ? 4 : 2, {kCameraCalibrationKind, kPointKind}),
      weight_(geometry.weight),
      T_right_left_(host.right ? geometry.T_imu_camera[host.camera + 1].Inverse() *
                                     geometry.T_imu_camera[host.camera]
                               : RigidTransform()),
      host_(MakeLensMeasurements(host, geometry)),
      first_camera_(host.camera),
      cameras_(host.right ? 2 : 1) {}

void HostPointResidual::EvaluateAt(const double* const* parameters, double* residuals,
                                   double** jacobians) const {
  const CameraCalibration calibration(parameters[0]);
  const Vector3d ray(parameters[1][0], parameters[1][1], 1);
  const double lambda = parameters[1][2];
  const Matrix3d r = T_right_left_.rotation.toRotationMatrix();
  for (int c = 0; c < cameras_; ++c) {
    const int camera = first_camera_ + c;
    const Projection projection(c == 0 ? ray : r * ray + lambda * T_right_left_.translation, camera,
                                calibration);
    Map<Vector2d>{residuals + 2 * c} =
        projection.Residual(host_[c], weight_, calibration.lens(camera));
    if (!jacobians) continue;
    const Matrix23d by_point = projection.ByPoint(host_[c], weight_, calibration.lens(camera));
    if (jacobians[0]) {
      Map<JacobianByCameras>{jacobians[0] + 2 * kCameraCalibrationSize* c} =
          projection.ByCalibration(by_point, camera, weight_, host_[c], calibration);
    }
    if (!jacobians[1]) continue;
    Map<Jacobian23> d(jacobians[1] + 6 * c);
    const Matrix23d by_given = camera == 1 ? by_point * calibration.R_true_right : by_point;
    if (c == 0) {
      d << by_given.leftCols<2>(), Vector2d::Zero();
      continue;
    }
    d.leftCols<2>() = by_given * r.leftCols<2>();
    d.rightCols<1>() = by_given * T_right_left_.translation;
  }
}

}  // namespace slcmap::odometry
