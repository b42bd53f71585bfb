// Whether a rig can be a stereo rig with the left camera on the left.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "data/angle_unit.h"
#include "data/calibration.h"
#include "data/check/check.h"
#include "data/check/left_right.h"

namespace slcmap {
namespace {

constexpr double kMinSideways = 0.8;  // of the baseline, along the left camera's x
constexpr double kMinAgreeing = 50;   // %, of the matches between left and right
constexpr double kMaxUsualBaseline_m = 1;
constexpr double kMaxAngle_rad = 20 * kDegree;  // between the optical axes

// Between the optical axes.
double AngleBetween_rad(const RigidTransform& T_left_right) {
  return std::acos(std::clamp((T_left_right.rotation * Eigen::Vector3d::UnitZ()).z(), -1.0, 1.0));
}

// The share of the baseline that points to the right of the left camera, -1 to 1.
double Sideways(const RigidTransform& T_left_right) {
  return T_left_right.translation.x() / T_left_right.translation.norm();
}

// What left and right images say outweighs where cameras usually are.
bool ImagesAgree(const CheckReport& report) {
  return std::ranges::any_of(report.figures, [](const CheckFigure& figure) {
    return figure.name == kAgreeingMatches && figure.value >= kMinAgreeing;
  });
}

// Cameras that are not side by side, the left one on the left.
void JudgeDirection(const Rig& rig, CheckReport* report) {
  const auto& poses = rig.T_imu_camera;
  const RigidTransform T_left_right = LeftRight(rig);
  const double sideways = Sideways(T_left_right);
  const double inverted = Sideways(poses[0] * poses[1].Inverse());
  const Eigen::Vector3d direction = T_left_right.translation.normalized();
  const std::string found = fmt::format(
      "the second camera is towards ({:.2f}, {:.2f}, {:.2f}) of the first, whose x is "
      "right, y down, z ahead",
      direction.x(), direction.y(), direction.z());
  if (sideways < -kMinSideways) {
    report->Fail("left-right", found, "swap cam0 and cam1, both folders and calibration");
  } else if (sideways < kMinSideways && inverted > kMinSideways) {
    report->Fail("extrinsics-direction", found,
                 "the transforms seem to be inverted: T_BS and T_imu_cam map camera to IMU, "
                 "T_cam_imu maps IMU to camera");
  } else if (sideways < kMinSideways && poses[0].rotation.isApprox(poses[1].rotation, 1e-9) &&
             poses[0].rotation.vec().norm() < 1e-9) {
    report->Fail("extrinsics-rotation", found + ", and both rotations to the IMU are the identity",
                 "write the rotations of cam0 and cam1 to the IMU (T_BS, T_imu_cam): they were "
                 "never filled in");
  } else if (sideways < kMinSideways) {
    report->Fail("baseline", found, "check the extrinsics; the cameras must be side by side");
  }
}

}  // namespace

void CheckStereoRig(const Rig& rig, CheckReport* report) {
  const RigidTransform T_left_right = LeftRight(rig);
  const double angle_rad = AngleBetween_rad(T_left_right);
  if (!ImagesAgree(*report)) JudgeDirection(rig, report);
  if (T_left_right.translation.norm() > kMaxUsualBaseline_m) {
    report->Warn("baseline",
                 fmt::format("{:.2f} m between the cameras", T_left_right.translation.norm()),
                 "check the unit of the translations (T_BS, T_cam_imu): metres are expected");
  }
  if (angle_rad > kMaxAngle_rad) {
    report->Warn("camera-angle", fmt::format("{:.1f} deg between the cameras", angle_rad / kDegree),
                 "check the extrinsics; little is seen by both cameras");
  }
}

void CheckCalibration(const Rig& rig, CheckReport* report) {
  const Camera& left = rig.cameras[0];
  report->AddFigure("calibrated width", left.width_px, "px");
  report->AddFigure("calibrated height", left.height_px, "px");
  report->AddFigure("focal length", left.fx_px, "px");
  report->AddFigure("camera time offset", 1e3 * rig.camera_time_offset_s, "ms");
  if (!IsStereo(rig)) return;
  const RigidTransform T_left_right = LeftRight(rig);
  report->AddFigure("baseline", T_left_right.translation.norm(), "m");
  report->AddFigure("angle between the cameras", AngleBetween_rad(T_left_right) / kDegree, "deg");
}

}  // namespace slcmap
