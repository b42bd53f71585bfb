#include "odometry/frontend/rectifier.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>

#include "data/calibration/calibration.h"
#include "data/core/error.h"

namespace slcmap::inline odometry {
namespace {

constexpr int kSizeStep_px = 8;      // the pyramid halves the image without rounding
constexpr int kMaskMargin_px = 4;    // interpolation and patches stay inside true pixels
constexpr double kOutside_px = -10;  // a map entry that no pixel has

// The common orientation of a pair of rectified cameras in the IMU frame: x along the baseline,
// wherever the second camera is beside the first one, z as near to both optical axes as that
// allows.
Eigen::Quaterniond CommonOrientation(const RigidTransform& T_imu_left,
                                     const RigidTransform& T_imu_right) {
  const Eigen::Matrix3d R_left = T_imu_left.rotation.toRotationMatrix();
  const Eigen::Matrix3d R_right = T_imu_right.rotation.toRotationMatrix();
  const Eigen::Vector3d x = (T_imu_right.translation - T_imu_left.translation).normalized();
  const Eigen::Vector3d z_mean = R_left.col(2) + R_right.col(2);
  if (StandBehind(T_imu_left, T_imu_right)) {
    throw DataError(
        "calibration: found a second camera that is not beside the first one looking the same way, "
        "expected cameras side by side or above each other, or that look apart (are T_BS and its "
        "inverse exchanged? one of them alone is used with --cameras 0)");
  }
  const Eigen::Vector3d y = z_mean.cross(x).normalized();
  Eigen::Matrix3d R;
  R << x, y, x.cross(y);
  return Eigen::Quaterniond(R);
}

// How far a camera sees on the plane z = 1 from its middle towards `direction`, at most `limit`.
double Extent(const Camera& camera, const Eigen::Matrix3d& R_camera_rectified,
              const Eigen::Vector2d& direction, double limit) {
  constexpr double kStep = 2e-3;
  double reached = 0;
  for (double r = kStep; r < limit; r += kStep) {
    const auto pixel = camera.Project(R_camera_rectified * (r * direction).homogeneous());
    if (!pixel || !camera.Contains(*pixel)) break;
    reached = r;
  }
  return reached;
}

int RoundedSize(double size_px) {
  return std::max(1, static_cast<int>(size_px / kSizeStep_px)) * kSizeStep_px;
}

// The pinhole that has the wanted scale in the middle of the left image and as much of the field of
// view as its middle row and column have.
Camera CommonPinhole(const Rig& rig, const Eigen::Quaterniond& R_imu_rectified, bool two,
                     const RectifierOptions& options) {
  const Camera& left = rig.cameras[0];
  const Camera& right = two ? rig.cameras[1] : left;
  const double focal_px = options.scale * std::sqrt(left.MiddleFocal_px() * right.MiddleFocal_px());
  const Eigen::Matrix3d R =
      (rig.T_imu_camera[0].rotation.conjugate() * R_imu_rectified).toRotationMatrix();
  const double limit = std::tan(options.max_field_of_view_rad / 2);
  const double x_min = Extent(left, R, {-1, 0}, limit), x_max = Extent(left, R, {1, 0}, limit);
  const double y_min = Extent(left, R, {0, -1}, limit), y_max = Extent(left, R, {0, 1}, limit);
  Camera pinhole;
  pinhole.fx_px = pinhole.fy_px = focal_px;
  pinhole.width_px = RoundedSize(focal_px * (x_min + x_max));
  pinhole.height_px = RoundedSize(focal_px * (y_min + y_max));
  pinhole.cx_px = 0.5 * (pinhole.width_px - 1) + 0.5 * focal_px * (x_min - x_max);
  pinhole.cy_px = 0.5 * (pinhole.height_px - 1) + 0.5 * focal_px * (y_min - y_max);
  if (pinhole.width_px < 16 || pinhole.height_px < 16) {
    throw DataError("calibration: found a rectified image of " + std::to_string(pinhole.width_px) +
                    " x " + std::to_string(pinhole.height_px) +
                    " px, expected overlapping fields of view (wrong intrinsics or extrinsics?)");
  }
  return pinhole;
}

// Where each pixel of the rectified image lies in the camera's image.
cv::Mat SourcePixels(const Camera& camera, const Camera& rectified,
                     const Eigen::Matrix3d& R_camera_rectified) {
  cv::Mat source(rectified.height_px, rectified.width_px, CV_32FC2);
  for (int v = 0; v < source.rows; ++v) {
    for (int u = 0; u < source.cols; ++u) {
      const Eigen::Vector3d ray((u - rectified.cx_px) / rectified.fx_px,
                                (v - rectified.cy_px) / rectified.fy_px, 1);
      const auto pixel = camera.Project(R_camera_rectified * ray);
      source.at<cv::Vec2f>(v, u) =
          pixel && camera.Contains(*pixel)
              ? cv::Vec2f(static_cast<float>(pixel->x()), static_cast<float>(pixel->y()))
              : cv::Vec2f(kOutside_px, kOutside_px);
    }
  }
  return source;
}

// `given` is that of the camera's image, or empty.
cv::Mat ValidMask(const cv::Mat& source_pixels, const cv::Mat& given) {
  cv::Mat mask(source_pixels.size(), CV_8UC1);
  for (int v = 0; v < mask.rows; ++v) {
    for (int u = 0; u < mask.cols; ++u) {
      mask.at<uchar>(v, u) = source_pixels.at<cv::Vec2f>(v, u)[0] >= 0 ? 255 : 0;
    }
  }
  if (!given.empty()) {
    cv::Mat seen;
    cv::remap(given, seen, source_pixels, cv::noArray(), cv::INTER_NEAREST);
    mask &= seen;
  }
  const int side = 2 * kMaskMargin_px + 1;
  cv::erode(mask, mask, cv::Mat::ones(side, side, CV_8UC1), {-1, -1}, 1, cv::BORDER_CONSTANT,
            cv::Scalar::all(0));
  return mask;
}

}  // namespace

Rectifier::Rectifier(const Rig& rig, const RectifierOptions& options)
    : given_rig_(rig), rectified_rig_(rig) {
  const auto count = static_cast<size_t>(CameraCount(rig));
  for (auto* images : {&map_xy_, &map_fraction_, &masks_}) images->resize(rig.cameras.size());
  std::optional<Camera> pinhole;
  for (const auto& [first, is_pair] : CameraGroups(rig)) {
    const RigidTransform& T_imu_first = rig.T_imu_camera[first];
    const bool is_apart =
        is_pair && (rig.T_imu_camera[first + 1].translation - T_imu_first.translation).norm() > 0;
    const Eigen::Quaterniond R_imu_rectified =
        is_apart ? CommonOrientation(T_imu_first, rig.T_imu_camera[first + 1])
                 : T_imu_first.rotation;
    if (!pinhole) {
      const bool two = is_apart || (!is_pair && count > 1);
      pinhole = CommonPinhole(rig, R_imu_rectified, two, options);
    }
    SetUp(first, *pinhole, R_imu_rectified);
    if (is_apart) SetUp(first + 1, *pinhole, R_imu_rectified);
  }
}

void Rectifier::SetUp(int camera, const Camera& pinhole,
                      const Eigen::Quaterniond& R_imu_rectified) {
  const auto i = static_cast<size_t>(camera);
  const Eigen::Quaterniond R_camera_rectified =
      given_rig_.T_imu_camera[i].rotation.conjugate() * R_imu_rectified;
  const cv::Mat source =
      SourcePixels(given_rig_.cameras[i], pinhole, R_camera_rectified.toRotationMatrix());
  cv::convertMaps(source, cv::noArray(), map_xy_[i], map_fraction_[i], CV_16SC2);
  masks_[i] = ValidMask(source, given_rig_.masks[i]);
  rectified_rig_.cameras[i] = pinhole;
  rectified_rig_.masks[i].release();  // masks_ has it
  rectified_rig_.T_imu_camera[i].rotation = R_imu_rectified;
}

void Rectifier::CorrectRight(const RightCorrection& correction) {
  if (!IsStereo(given_rig_)) return;
  // The frame of the rectified images stays where it is, and the camera in it has turned.
  const Eigen::Quaterniond R_camera_rectified =
      given_rig_.T_imu_camera[1].rotation.conjugate() * rectified_rig_.T_imu_camera[1].rotation;
  Camera camera = given_rig_.cameras[1];
  camera.cx_px += correction.centre_px.x();
  camera.cy_px += correction.centre_px.y();
  const cv::Mat source = SourcePixels(
      camera, rectified_rig_.cameras[1],
      (R_camera_rectified * ExpRotation(correction.rotation_rad).conjugate()).toRotationMatrix());
  cv::convertMaps(source, cv::noArray(), map_xy_[1], map_fraction_[1], CV_16SC2);
}

cv::Mat Rectifier::Rectify(const cv::Mat& image, int camera) const {
  cv::Mat rectified;
  cv::remap(image, rectified, map_xy_[camera], map_fraction_[camera], cv::INTER_LINEAR,
            cv::BORDER_CONSTANT, cv::Scalar::all(0));
  return rectified;
}

namespace {

bool IsUniform(const cv::Mat& image) {
  double low = 0, high = 0;
  cv::minMaxLoc(image, &low, &high);
  return low == high;
}

// Stops at the first row that differs: with sensor noise, that is the first.
bool Equal(const cv::Mat& a, const cv::Mat& b) {
  if (a.empty() || a.size() != b.size() || a.type() != b.type()) return false;
  const size_t row_bytes = static_cast<size_t>(a.cols) * a.elemSize();
  for (int row = 0; row < a.rows; ++row) {
    if (std::memcmp(a.ptr(row), b.ptr(row), row_bytes) != 0) return false;
  }
  return !IsUniform(a);
}

}  // namespace

bool RepeatedImages::Repeats(const cv::Mat& image) {
  const bool repeats = Equal(image, last_);
  image.copyTo(last_);
  return repeats;
}

}  // namespace slcmap::odometry
