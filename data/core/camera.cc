#include "data/core/camera.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "data/core/error.h"

namespace slcmap::inline data {
namespace {

constexpr int kMaxIterations = 30;
constexpr int kMaxShortenings = 10;  // of a step of Newton's method
constexpr double kPi = 3.14159265358979323846;

// A ray's image on the plane of the lens, before focal lengths and principal point.
using OnPlane = std::optional<Eigen::Vector2d>;

struct RadialTangential {
  Eigen::Vector2d distorted;
  Eigen::Matrix2d jacobian;  // d distorted / d (x, y)
};

// The radial-tangential model on the plane z = 1 (OpenCV, "Camera Calibration and 3D
// Reconstruction"): radial terms as a quotient, tangential ones, and those of a thin prism.
RadialTangential DistortRadialTangential(const Camera& camera, double x, double y) {
  const Eigen::Vector4d& k = camera.coefficients;
  const auto& h = camera.higher_coefficients;
  const double r2 = x * x + y * y;
  const double above = 1 + r2 * (k[0] + r2 * (k[1] + r2 * h[0]));
  const double below = 1 + r2 * (h[1] + r2 * (h[2] + r2 * h[3]));
  const double radial = above / below;
  // d radial / d x = x * d_radial
  const double d_radial = 2 *
                          ((k[0] + r2 * (2 * k[1] + r2 * 3 * h[0])) -
                           radial * (h[1] + r2 * (2 * h[2] + r2 * 3 * h[3]))) /
                          below;
  const Eigen::Vector2d prism(r2 * (h[4] + r2 * h[5]), r2 * (h[6] + r2 * h[7]));
  const Eigen::Vector2d d_prism(2 * (h[4] + 2 * r2 * h[5]), 2 * (h[6] + 2 * r2 * h[7]));
  RadialTangential out;
  out.distorted << x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x) + prism.x(),
      y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y + prism.y();
  out.jacobian << radial + x * x * d_radial + 2 * k[2] * y + 6 * k[3] * x + x * d_prism.x(),
      x * y * d_radial + 2 * k[2] * x + 2 * k[3] * y + y * d_prism.x(),
      x * y * d_radial + 2 * k[2] * x + 2 * k[3] * y + x * d_prism.y(),
      radial + y * y * d_radial + 6 * k[2] * y + 2 * k[3] * x + y * d_prism.y();
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

constexpr int kMaxHalvings = 40;

template <size_t kCount>
bool IsBernsteinPositive(const std::array<double, kCount>& c, int halvings) {
  if (c.front() <= 0 || c.back() <= 0) return false;
  if (std::ranges::min(c) > 0) return true;
  if (halvings == kMaxHalvings) return false;  // touches zero
  std::array<double, kCount> first, second = c;
  for (size_t i = 0; i < kCount; ++i) {
    first[i] = second[0];
    for (size_t j = 0; j + i + 1 < kCount; ++j) second[j] = 0.5 * (second[j] + second[j + 1]);
  }
  return IsBernsteinPositive(first, halvings + 1) && IsBernsteinPositive(second, halvings + 1);
}

// Whether a polynomial, its coefficients by rising powers, is above zero on all of [0, end]: surely
// where its Bernstein coefficients there are, whose means its values are (Farouki, "The Bernstein
// polynomial basis: a centennial retrospective", 2012); else halves are looked at.
template <size_t kCount>
bool IsPositiveUpTo(std::array<double, kCount> c, double end) {
  double power = 1;
  for (double& coefficient : c) coefficient *= std::exchange(power, power * end);
  // Differences into sums, on a scale of binomial coefficients.
  double binomial = 1;
  for (size_t i = 0; i < kCount; ++i) {
    c[i] /= binomial;
    binomial *= static_cast<double>(kCount - 1 - i) / static_cast<double>(i + 1);
  }
  for (size_t i = 1; i < kCount; ++i) {
    for (size_t j = kCount - 1; j >= i; --j) c[j] += c[j - 1];
  }
  return IsBernsteinPositive(c, 0);
}

// Whether radial distortion turns back up to the squared radius s: where the derivative of
// r above(s) / below(s) by r, or `below` itself, is not above zero.
bool FoldsUpTo(const Camera& camera, double s) {
  const auto& h = camera.higher_coefficients;
  const std::array<double, 4> above = {1, camera.coefficients[0], camera.coefficients[1], h[0]};
  const std::array<double, 4> below = {1, h[1], h[2], h[3]};
  std::array<double, 7> derivative = {};  // times below^2
  for (size_t i = 0; i < 4; ++i) {
    for (size_t j = 0; j < 4; ++j) {
      const double order = 1 + 2 * static_cast<double>(i) - 2 * static_cast<double>(j);
      derivative[i + j] += order * above[i] * below[j];
    }
  }
  return !IsPositiveUpTo(below, s) || !IsPositiveUpTo(derivative, s);
}

bool IsFolded(const Camera& camera, double x, double y) {
  const double s = x * x + y * y;
  if (camera.higher_coefficients.isZero(0)) return s >= FoldingRadiusSquared(camera.coefficients);
  return FoldsUpTo(camera, s);
}

OnPlane ProjectRadialTangential(const Camera& camera, double x, double y) {
  if (IsFolded(camera, x, y)) return std::nullopt;
  const RadialTangential at = DistortRadialTangential(camera, x, y);
  if (at.jacobian.determinant() <= 0) return std::nullopt;  // terms that are not radial fold too
  return at.distorted;
}

// The equidistant model: the distorted radius of a ray at the angle theta_rad, and its derivative.
double DistortAngle(const Eigen::Vector4d& k, double theta_rad, double* derivative) {
  const double t2 = theta_rad * theta_rad;
  *derivative = 1 + t2 * (3 * k[0] + t2 * (5 * k[1] + t2 * (7 * k[2] + t2 * 9 * k[3])));
  return theta_rad * (1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
}

// Whether the distorted radius falls again before the angle.
bool IsAngleFolded(const Eigen::Vector4d& k, double theta_rad) {
  return theta_rad > kPi || !IsPositiveUpTo(std::array{1.0, 3 * k[0], 5 * k[1], 7 * k[2], 9 * k[3]},
                                            theta_rad * theta_rad);
}

// Newton's method for the angle whose distorted radius is `radius`; steps that would lead beyond
// where the lens folds are shortened. Nothing where no angle has it.
std::optional<double> UndistortAngle(const Eigen::Vector4d& k, double radius) {
  double theta_rad = std::min(radius, kPi / 2);
  for (int i = 0; i < kMaxIterations && IsAngleFolded(k, theta_rad); ++i) theta_rad *= 0.5;
  for (int i = 0; i < kMaxIterations; ++i) {
    double derivative = 0;
    const double error = DistortAngle(k, theta_rad, &derivative) - radius;
    if (std::abs(error) < 1e-12) return theta_rad;
    if (derivative <= 0) return std::nullopt;
    double step_rad = error / derivative;
    const auto is_too_long = [&](double next_rad) {
      double ignored = 0;
      return next_rad < 0 || IsAngleFolded(k, next_rad) ||
             std::abs(DistortAngle(k, next_rad, &ignored) - radius) > std::abs(error);
    };
    for (int h = 0; h < kMaxShortenings && is_too_long(theta_rad - step_rad); ++h) step_rad *= 0.5;
    theta_rad -= step_rad;
    if (theta_rad < 0 || IsAngleFolded(k, theta_rad)) return std::nullopt;
  }
  return std::nullopt;
}

// Newton's method for the point on z = 1 whose distorted image is `target`; steps that fold or lead
// no nearer are shortened. Nothing where no point has it.
std::optional<Eigen::Vector2d> UndistortRadialTangential(const Camera& camera,
                                                         const Eigen::Vector2d& target) {
  Eigen::Vector2d p = target;
  for (int i = 0; i < kMaxIterations && IsFolded(camera, p.x(), p.y()); ++i) p *= 0.5;
  RadialTangential at = DistortRadialTangential(camera, p.x(), p.y());
  for (int i = 0; i < kMaxIterations; ++i) {
    const Eigen::Vector2d error = at.distorted - target;
    if (at.jacobian.determinant() <= 0) return std::nullopt;
    if (error.squaredNorm() < 1e-24) return p;
    Eigen::Vector2d step = at.jacobian.inverse() * error, next = p - step;
    const auto is_too_long = [&] {
      if (IsFolded(camera, next.x(), next.y())) return true;
      at = DistortRadialTangential(camera, next.x(), next.y());
      return at.jacobian.determinant() <= 0 || (at.distorted - target).norm() > error.norm();
    };
    for (int h = 0; is_too_long(); ++h) {
      if (h == kMaxShortenings) return std::nullopt;
      step *= 0.5;
      next = p - step;
    }
    p = next;
  }
  return std::nullopt;
}

OnPlane ProjectEquidistant(const Camera& camera, const Eigen::Vector3d& p) {
  const double r = p.head<2>().norm();
  const double theta_rad = std::atan2(r, p.z());
  if (IsAngleFolded(camera.coefficients, theta_rad)) return std::nullopt;
  double derivative = 0;
  const double radius = DistortAngle(camera.coefficients, theta_rad, &derivative);
  if (r < 1e-12 && p.z() <= 0) return std::nullopt;
  return r < 1e-12 ? Eigen::Vector2d::Zero() : Eigen::Vector2d(p.head<2>() * (radius / r));
}

// Where a ray at the angle theta_rad from the axis lies in the direction of `target`.
Eigen::Vector3d RayAt(const Eigen::Vector2d& target, double theta_rad) {
  const double radius = target.norm();
  if (radius < 1e-12) return {0, 0, 1};
  Eigen::Vector3d ray;
  ray << target * (std::sin(theta_rad) / radius), std::cos(theta_rad);
  return ray;
}

// Mei and Rives, "Single view point omnidirectional camera calibration from planar grids" (2007):
// the unit sphere seen from xi behind its centre. Beyond the given height both halves fall
// together.
OnPlane ProjectOmni(const Camera& camera, const Eigen::Vector3d& p) {
  const double xi = camera.shape[0];
  const Eigen::Vector3d s = p.normalized();
  if (s.z() <= -(xi > 1 ? 1 / xi : xi) + 1e-9) return std::nullopt;
  return ProjectRadialTangential(camera, s.x() / (s.z() + xi), s.y() / (s.z() + xi));
}

std::optional<Eigen::Vector3d> UnprojectOmni(const Camera& camera, const Eigen::Vector2d& target) {
  const auto m = UndistortRadialTangential(camera, target);
  if (!m) return std::nullopt;
  const double xi = camera.shape[0], r2 = m->squaredNorm(), inside = 1 + (1 - xi * xi) * r2;
  if (inside < 0) return std::nullopt;
  const double scale = (xi + std::sqrt(inside)) / (1 + r2);
  return Eigen::Vector3d(scale * m->x(), scale * m->y(), scale - xi);
}

// Cosine of the angle from the axis up to which EUCM projects, and with xi the double sphere
// (Usenko, Demmel and Cremers, "The Double Sphere Camera Model", 2018, sections II and III).
double LeastHeight(double alpha) {
  return alpha <= 0.5 ? alpha / (1 - alpha) : (1 - alpha) / alpha;
}

// Khomutenko, Garcia and Martinet, "An Enhanced Unified Camera Model" (2016).
OnPlane ProjectExtendedUnified(const Camera& camera, const Eigen::Vector3d& p) {
  const double alpha = camera.shape[0], beta = camera.shape[1];
  const double d = std::sqrt(beta * p.head<2>().squaredNorm() + p.z() * p.z());
  if (d < 1e-12 || p.z() <= -LeastHeight(alpha) * d + 1e-9) return std::nullopt;
  return p.head<2>() / (alpha * d + (1 - alpha) * p.z());
}

std::optional<Eigen::Vector3d> UnprojectExtendedUnified(const Camera& camera,
                                                        const Eigen::Vector2d& m) {
  const double alpha = camera.shape[0], beta = camera.shape[1], r2 = m.squaredNorm();
  const double inside = 1 - (2 * alpha - 1) * beta * r2;
  if (inside < 0) return std::nullopt;
  const double z = (1 - beta * alpha * alpha * r2) / (alpha * std::sqrt(inside) + 1 - alpha);
  return Eigen::Vector3d(m.x(), m.y(), z).normalized();
}

OnPlane ProjectDoubleSphere(const Camera& camera, const Eigen::Vector3d& p) {
  const double xi = camera.shape[0], alpha = camera.shape[1], d1 = p.norm();
  const double w1 = LeastHeight(alpha), w2 = (w1 + xi) / std::sqrt(2 * w1 * xi + xi * xi + 1);
  if (d1 < 1e-12 || p.z() <= -w2 * d1 + 1e-9) return std::nullopt;
  const double z = xi * d1 + p.z(), d2 = std::sqrt(p.head<2>().squaredNorm() + z * z);
  return p.head<2>() / (alpha * d2 + (1 - alpha) * z);
}

std::optional<Eigen::Vector3d> UnprojectDoubleSphere(const Camera& camera,
                                                     const Eigen::Vector2d& m) {
  const double xi = camera.shape[0], alpha = camera.shape[1], r2 = m.squaredNorm();
  const double inside = 1 - (2 * alpha - 1) * r2;
  if (inside < 0) return std::nullopt;
  const double z = (1 - alpha * alpha * r2) / (alpha * std::sqrt(inside) + 1 - alpha);
  const double under = z * z + (1 - xi * xi) * r2;
  if (under < 0) return std::nullopt;
  const double scale = (z * xi + std::sqrt(under)) / (z * z + r2);
  return Eigen::Vector3d(scale * m.x(), scale * m.y(), scale * z - xi);
}

// Devernay and Faugeras, "Straight lines have to be straight" (2001).
OnPlane ProjectFieldOfView(const Camera& camera, const Eigen::Vector3d& p) {
  if (p.z() < 1e-6) return std::nullopt;
  const double w = camera.shape[0];
  const Eigen::Vector2d at = p.head<2>() / p.z();
  const double r = at.norm();
  if (r < 1e-9) return Eigen::Vector2d(at * (2 * std::tan(w / 2) / w));
  return at * (std::atan(2 * r * std::tan(w / 2)) / (w * r));
}

std::optional<Eigen::Vector3d> UnprojectFieldOfView(const Camera& camera,
                                                    const Eigen::Vector2d& m) {
  const double w = camera.shape[0], angle_rad = m.norm() * w;
  if (angle_rad >= kPi / 2) return std::nullopt;
  return RayAt(m, std::atan(std::tan(angle_rad) / (2 * std::tan(w / 2))));
}

OnPlane ProjectPinhole(const Camera& camera, const Eigen::Vector3d& p) {
  if (p.z() < 1e-6) return std::nullopt;
  const double x = p.x() / p.z(), y = p.y() / p.z();
  if (camera.distortion == Distortion::kNone) return Eigen::Vector2d(x, y);
  return ProjectRadialTangential(camera, x, y);
}

// What the focal length is multiplied by in the middle of the image.
double PixelScale(const Camera& camera) {
  if (camera.distortion == Distortion::kOmni || camera.distortion == Distortion::kDoubleSphere) {
    return 1 / (1 + camera.shape[0]);
  }
  if (camera.distortion != Distortion::kFieldOfView) return 1;
  return 2 * std::tan(camera.shape[0] / 2) / camera.shape[0];
}

template <typename Fail>
void CheckShape(const Camera& camera, const Fail& fail) {
  const double a = camera.shape[0], b = camera.shape[1];
  const auto expect = [&](bool is_plausible, const std::string& expected) {
    if (is_plausible) return;
    const bool has_two = camera.distortion == Distortion::kExtendedUnified ||
                         camera.distortion == Distortion::kDoubleSphere;
    fail(camera.distortion == Distortion::kFieldOfView
             ? "the distortion coefficient (w)"
             : "intrinsics (first the lens's own numbers, then fx, fy, cx, cy)",
         "found " + std::to_string(a) + (has_two ? " and " + std::to_string(b) : "") +
             " as the numbers of the lens, expected " + expected);
  };
  switch (camera.distortion) {
    case Distortion::kOmni:
      return expect(a >= 0 && a < 10, "xi of 0 to 10");
    case Distortion::kExtendedUnified:
      return expect(a >= 0 && a <= 1 && b > 0 && b < 10, "alpha of 0 to 1 and beta of 0 to 10");
    case Distortion::kDoubleSphere:
      return expect(a > -1 && a < 10 && b >= 0 && b <= 1, "xi above -1 and alpha of 0 to 1");
    case Distortion::kFieldOfView:
      return expect(a > 1e-3 && a < kPi, "w of 0.001 to 3.14 rad");
    default:
      return;
  }
}

}  // namespace

std::optional<Eigen::Vector2d> Camera::Project(const Eigen::Vector3d& p_camera) const {
  const OnPlane on_plane = [&] {
    switch (distortion) {
      case Distortion::kEquidistant:
        return ProjectEquidistant(*this, p_camera);
      case Distortion::kOmni:
        return ProjectOmni(*this, p_camera);
      case Distortion::kExtendedUnified:
        return ProjectExtendedUnified(*this, p_camera);
      case Distortion::kDoubleSphere:
        return ProjectDoubleSphere(*this, p_camera);
      case Distortion::kFieldOfView:
        return ProjectFieldOfView(*this, p_camera);
      case Distortion::kNone:
      case Distortion::kRadialTangential:
        break;
    }
    return ProjectPinhole(*this, p_camera);
  }();
  if (!on_plane) return std::nullopt;
  return Eigen::Vector2d(fx_px * on_plane->x() + cx_px, fy_px * on_plane->y() + cy_px);
}

std::optional<Eigen::Vector3d> Camera::Unproject(const Eigen::Vector2d& pixel_px) const {
  const Eigen::Vector2d target((pixel_px.x() - cx_px) / fx_px, (pixel_px.y() - cy_px) / fy_px);
  switch (distortion) {
    case Distortion::kEquidistant: {
      if (target.norm() < 1e-12) return Eigen::Vector3d(0, 0, 1);
      const auto theta_rad = UndistortAngle(coefficients, target.norm());
      if (!theta_rad) return std::nullopt;
      return RayAt(target, *theta_rad);
    }
    case Distortion::kOmni:
      return UnprojectOmni(*this, target);
    case Distortion::kExtendedUnified:
      return UnprojectExtendedUnified(*this, target);
    case Distortion::kDoubleSphere:
      return UnprojectDoubleSphere(*this, target);
    case Distortion::kFieldOfView:
      return UnprojectFieldOfView(*this, target);
    case Distortion::kNone:
      return target.homogeneous().normalized();
    case Distortion::kRadialTangential:
      break;
  }
  const auto p = UndistortRadialTangential(*this, target);
  if (!p) return std::nullopt;
  return p->homogeneous().normalized();
}

double Camera::MiddleFocal_px() const { return PixelScale(*this) * std::sqrt(fx_px * fy_px); }

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
  const double scale = PixelScale(*this);
  for (const double f_px : {fx_px * scale, fy_px * scale}) {
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
  CheckShape(*this, fail);
  // Terms above and below a quotient cancel each other, and the plane behind a sphere is small.
  const bool is_usual = higher_coefficients.isZero(0) && distortion != Distortion::kOmni;
  const double most = is_usual ? 10 : 1e4;
  const auto absurd = [&](const auto& values) {
    return !values.allFinite() || values.cwiseAbs().maxCoeff() > most;
  };
  if (absurd(coefficients) || absurd(higher_coefficients)) {
    fail("the distortion coefficients (k1, k2, p1, p2 or k1 to k4)",
         "found distortion coefficients that are not finite or above " +
             std::to_string(static_cast<int>(most)) + " in size");
  }
}

}  // namespace slcmap::data
