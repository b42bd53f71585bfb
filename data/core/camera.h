// A calibrated camera: where a point in its frame is seen, and along which ray a pixel looks.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

namespace slcmap::inline data {

// A pinhole with a distortion on the plane z = 1 (none, radial-tangential), or a lens that a
// pinhole does not describe. Files hold the names of data/calibration/camera_words.h, not these.
enum class Distortion {
  kNone,
  kRadialTangential,  // OpenCV's with up to 12 coefficients: plumb_bob, rational_polynomial
  kEquidistant,       // Kannala-Brandt with four coefficients, OpenCV's fisheye
  kOmni,              // Mei: a sphere, shifted by xi, then radial-tangential
  kExtendedUnified,   // EUCM: shape alpha, beta
  kDoubleSphere,      // shape xi, alpha
  kFieldOfView,       // FOV: shape w
};

// Pixel coordinates have their origin at the centre of the top left pixel, x right, y down. The
// camera frame has x right, y down, z forward.
struct Camera {
  Distortion distortion = Distortion::kNone;
  int width_px = 0;
  int height_px = 0;
  double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;
  // k1 k2 p1 p2 (radial-tangential, omni, as OpenCV) or k1 k2 k3 k4 (equidistant, as OpenCV's
  // fisheye).
  Eigen::Vector4d coefficients = Eigen::Vector4d::Zero();
  // Radial-tangential: k3 k4 k5 k6 s1 s2 s3 s4, as OpenCV goes on.
  Eigen::Matrix<double, 8, 1> higher_coefficients = Eigen::Matrix<double, 8, 1>::Zero();
  // What the other lenses are made of: xi (omni), alpha and beta, xi and alpha, or w.
  Eigen::Vector2d shape = Eigen::Vector2d::Zero();

  // The pixel of a point in the camera frame; nothing where the model does not reach (behind a
  // radial-tangential camera, or beyond the angle at which its distortion folds back).
  std::optional<Eigen::Vector2d> Project(const Eigen::Vector3d& p_camera) const;

  // The unit ray, in the camera frame, of a pixel; nothing where the distortion cannot be inverted.
  std::optional<Eigen::Vector3d> Unproject(const Eigen::Vector2d& pixel_px) const;

  // Pixels a radian in the middle of the image; for most lenses the focal length.
  double MiddleFocal_px() const;

  // True where the pixel is in the image, at least margin_px from its border.
  bool Contains(const Eigen::Vector2d& pixel_px, double margin_px = 0) const;

  // Throws DataError when an entry is absurd; `name` stands in the message.
  void Check(const std::string& name) const;
};

}  // namespace slcmap::data
