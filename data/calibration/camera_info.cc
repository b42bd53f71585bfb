#include "data/calibration/camera_info.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "data/calibration/calibration_keys.h"
#include "data/core/error.h"

namespace slcmap::inline data {
namespace {

constexpr double kSameFocal = 1e-4;          // relative; rectified pairs have one to the last digit
constexpr double kMinInfoBaseline_m = 1e-3;  // less is a driver that writes none

bool HasDistortion(const CameraInfo& info) {
  return std::ranges::any_of(info.d, [](double value) { return value != 0; });
}

bool HasProjection(const CameraInfo& info) { return info.p(0, 0) > 0 && info.p(1, 1) > 0; }

bool IsRotation(const Eigen::Matrix3d& r) {
  constexpr double kMaxError = 1e-3;
  return (r * r.transpose() - Eigen::Matrix3d::Identity()).norm() < kMaxError &&
         r.determinant() > 0;
}

// Where a camera stands on the common x axis, in metres.
double PlaceOnBaseline_m(const CameraInfo& info) { return -info.p(0, 3) / info.p(0, 0); }

// Drivers that know no rectification write identities as R.
bool AreRectifying(const CameraInfo& left, const CameraInfo& right) {
  if (left.r.isIdentity(0) && right.r.isIdentity(0)) return false;
  const auto same = [](double a, double b) { return std::abs(a - b) <= kSameFocal * std::abs(a); };
  return IsRotation(left.r) && IsRotation(right.r) && same(left.p(0, 0), right.p(0, 0)) &&
         same(left.p(1, 1), right.p(1, 1)) && same(left.p(1, 2), right.p(1, 2));
}

[[noreturn]] void FailInfo(const CameraInfo& info, const std::string& found) {
  throw InputFault(
      "calibration",
      fmt::format("{}: found {}, expected the camera's calibration", info.place, found),
      "the driver had no calibration: calibrate the rig, and name the file with "
      "--calibration");
}

}  // namespace

bool IsUndistorted(const CameraInfo& info) {
  constexpr double kSame_px = 1e-3;
  return !HasDistortion(info) && (info.k - info.p.leftCols<3>()).cwiseAbs().maxCoeff() < kSame_px;
}

Camera CameraFromInfo(const CameraInfo& info, ImageKind kind) {
  if (info.k.isZero(0) && info.p.isZero(0)) FailInfo(info, "zeros as K and P");
  CameraWords words{"pinhole", "none", {}, {}};
  if (kind == ImageKind::kRectified && HasProjection(info)) {
    words.intrinsics = {info.p(0, 0), info.p(1, 1), info.p(0, 2), info.p(1, 2)};
  } else if (kind == ImageKind::kRectified && HasDistortion(info)) {
    FailInfo(info, "zeros as P of rectified images");
  } else {
    if (info.k.isZero(0)) FailInfo(info, "zeros as K");
    words.intrinsics = {info.k(0, 0), info.k(1, 1), info.k(0, 2), info.k(1, 2)};
    if (HasDistortion(info)) {
      words.distortion_model = info.distortion_model;
      words.coefficients = info.d;
      // Drivers fill up what a lens has not.
      const bool is_fisheye = FindDistortion(info.distortion_model) == Distortion::kEquidistant;
      while (is_fisheye && words.coefficients.size() > 4 && words.coefficients.back() == 0) {
        words.coefficients.pop_back();
      }
    }
  }
  return RequiredCamera(words, {info.width_px, info.height_px}, info.place);
}

std::optional<RigidTransform> RightPoseFromInfo(const CameraInfo& left, const CameraInfo& right,
                                                ImageKind kind) {
  if (!HasProjection(left) || !HasProjection(right)) return std::nullopt;
  const double baseline_m = PlaceOnBaseline_m(right) - PlaceOnBaseline_m(left);
  if (!(std::abs(baseline_m) >= kMinInfoBaseline_m)) return std::nullopt;
  const RigidTransform T_rectified(Eigen::Quaterniond::Identity(), {baseline_m, 0, 0});
  if (kind == ImageKind::kRectified) return T_rectified;
  if (!AreRectifying(left, right)) return std::nullopt;
  const RigidTransform of_left(Eigen::Quaterniond(left.r).normalized(), Eigen::Vector3d::Zero());
  const RigidTransform of_right(Eigen::Quaterniond(right.r).normalized(), Eigen::Vector3d::Zero());
  return of_left.Inverse() * T_rectified * of_right;
}

}  // namespace slcmap::data
