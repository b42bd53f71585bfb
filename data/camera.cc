#include "data/camera.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "data/input_fault.h"

namespace slcmap {
namespace {

constexpr int kMaxIterations = 30;
constexpr double kPi = 3.14159265358979323846;

struct RadialTangential {
  Eigen::Vector2d distorted;
  Eigen::Matrix2d jacobian;  // d distorted / d (x, y)
};

// The radial-tangential model on the plane z = 1 (OpenCV, "Camera Calibration and 3D
// Reconstruction").
RadialTangential DistortRadialTangential(const Eigen::Vector4d& k, double x, double y) {
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (k[0] + r2 * k[1]);
  const double d_radial = 2 * (k[0] + 2 * k[1] * r2);  // d radial / d x = x * d_radial
  RadialTangential out;
  out.distorted << x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x),
      y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y;
  out.jacobian << radial + x * x * d_radial + 2 * k[2] * y + 6 * k[3] * x,
      x * y * d_radial + 2 * k[2] * x + 2 * k[3] * y,
      x * y * d_radial + 2 * k[2] * x + 2 * k[3] * y,
      radial + y * y * d_radial + 6 * k[2] * y + 2 * k[3] * x;
  return out;
}

// The squared radius at which the radial distortion r (1 + k1 r^2 + k2 r^4) turns back: the
// smallest positive root of its derivative 1 + 3 k1 s + 5 k2 s^2 in s = r^2; infinity where there
// is none.
double FoldingRadiusSquared(const Eigen::Vector4d& k) {
  const double a = 5 * k[1], b = 3 * k[0];
  const double infinity = std::numeric_limits<double>::infinity();
  if (std::abs(a) < 1e-12) return b < 0 ? -1 / b : infinity;
  const double discriminant = b * b - 4 * a;
  if (discriminant < 0) return infinity;
  const double root = std::sqrt(discriminant);
  double smallest = infinity;
  for (const double s : {(-b - root) / (2 * a), (-b + root) / (2 * a)}) {
    if (s > 0) smallest = std::min(smallest, s);
  }
  return smallest;
}

// The equidistant model: the distorted radius of a ray at the angle theta_rad, and its derivative.
double DistortAngle(const Eigen::Vector4d& k, double theta_rad, double* derivative) {
  const double t2 = theta_rad * theta_rad;
  *derivative = 1 + t2 * (3 * k[0] + t2 * (5 * k[1] + t2 * (7 * k[2] + t2 * 9 * k[3])));
  return theta_rad * (1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
}

// Newton's method for the angle whose distorted radius is `radius`; nothing if it does not
// converge.
std::optional<double> UndistortAngle(const Eigen::Vector4d& k, double radius) {
  double theta_rad = std::min(radius, kPi / 2);
  for (int i = 0; i < kMaxIterations; ++i) {
    double derivative = 0;
    const double error = DistortAngle(k, theta_rad, &derivative) - radius;
    if (std::abs(error) < 1e-12) return theta_rad;
    if (derivative <= 0) return std::nullopt;
    theta_rad -= error / derivative;
    if (theta_rad < 0 || theta_rad > kPi) return std::nullopt;
  }
  return std::nullopt;
}

// Newton's method for the point on z = 1 whose distorted image is `target`.
std::optional<Eigen::Vector2d> UndistortRadialTangential(const Eigen::Vector4d& k,
                                                         const Eigen::Vector2d& target) {
  Eigen::Vector2d p = target;
  for (int i = 0; i < kMaxIterations; ++i) {
    const RadialTangential at = DistortRadialTangential(k, p.x(), p.y());
    const Eigen::Vector2d error = at.distorted - target;
    if (at.jacobian.determinant() <= 0) return std::nullopt;
    if (error.squaredNorm() < 1e-24) return p;
    p -= at.jacobian.inverse() * error;
  }
  return std::nullopt;
}

}  // namespace

std::optional<Eigen::Vector2d> Camera::Project(const Eigen::Vector3d& p_camera) const {
  Eigen::Vector2d on_plane;
  if (distortion == Distortion::kEquidistant) {
    const double r = p_camera.head<2>().norm();
    const double theta_rad = std::atan2(r, p_camera.z());
    double derivative = 0;
    const double radius = DistortAngle(coefficients, theta_rad, &derivative);
    if (derivative <= 0) return std::nullopt;
    on_plane =
        r < 1e-12 ? Eigen::Vector2d::Zero() : Eigen::Vector2d(p_camera.head<2>() * (radius / r));
    if (r < 1e-12 && p_camera.z() <= 0) return std::nullopt;
  } else {
    if (p_camera.z() < 1e-6) return std::nullopt;
    const double x = p_camera.x() / p_camera.z(), y = p_camera.y() / p_camera.z();
    const Eigen::Vector4d k =
        distortion == Distortion::kNone ? Eigen::Vector4d(Eigen::Vector4d::Zero()) : coefficients;
    if (x * x + y * y >= FoldingRadiusSquared(k)) return std::nullopt;
    const RadialTangential at = DistortRadialTangential(k, x, y);
    on_plane = at.distorted;
  }
  return Eigen::Vector2d(fx_px * on_plane.x() + cx_px, fy_px * on_plane.y() + cy_px);
}

std::optional<Eigen::Vector3d> Camera::Unproject(const Eigen::Vector2d& pixel_px) const {
  const Eigen::Vector2d target((pixel_px.x() - cx_px) / fx_px, (pixel_px.y() - cy_px) / fy_px);
  if (distortion == Distortion::kNone) return target.homogeneous().normalized();
  if (distortion == Distortion::kRadialTangential) {
    const auto p = UndistortRadialTangential(coefficients, target);
    if (!p) return std::nullopt;
    return p->homogeneous().normalized();
  }
  const double radius = target.norm();
  if (radius < 1e-12) return Eigen::Vector3d(0, 0, 1);
  const auto theta_rad = UndistortAngle(coefficients, radius);
  if (!theta_rad) return std::nullopt;
  Eigen::Vector3d ray;
  ray << target * (std::sin(*theta_rad) / radius), std::cos(*theta_rad);
  return ray;
}

bool Camera::Contains(const Eigen::Vector2d& pixel_px, double margin_px) const {
  return pixel_px.x() >= margin_px && pixel_px.y() >= margin_px &&
         pixel_px.x() <= width_px - 1 - margin_px && pixel_px.y() <= height_px - 1 - margin_px;
}

void Camera::Check(const std::string& name) const {
  const auto fail = [&](const char* key, const std::string& what) {
    throw InputFault("calibration", name + ": " + what,
                     std::string("correct ") + key + " in " + name);
  };
  if (width_px < 16 || height_px < 16 || width_px > 20000 || height_px > 20000) {
    fail("resolution (width, height)", "found resolution " + std::to_string(width_px) + " x " +
                                           std::to_string(height_px) +
                                           ", expected 16 to 20000 pixels a side");
  }
  const double longer_px = std::max(width_px, height_px);
  for (const double f_px : {fx_px, fy_px}) {
    if (!(f_px > 0.1 * longer_px && f_px < 20 * longer_px)) {
      fail("intrinsics (fx, fy, cx, cy in pixels)",
           "found focal length " + std::to_string(f_px) + " px, expected 0.1 to 20 times " +
               std::to_string(static_cast<int>(longer_px)) + " px");
    }
  }
  if (!(cx_px > 0 && cx_px < width_px && cy_px > 0 && cy_px < height_px)) {
    fail("intrinsics (fx, fy, cx, cy in pixels)",
         "found principal point (" + std::to_string(cx_px) + ", " + std::to_string(cy_px) +
             "), expected one inside the image");
  }
  if (!coefficients.allFinite() || coefficients.cwiseAbs().maxCoeff() > 10) {
    fail("the distortion coefficients (k1, k2, p1, p2 or k1 to k4)",
         "found distortion coefficients that are not finite or above 10 in size");
  }
}

}  // namespace slcmap
