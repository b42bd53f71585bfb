#include "odometry/geometry/exposure.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace slcmap::inline odometry {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kNearest_m = 0.05, kNearest_per_m = 3;  // before a camera; as a first guess

RigidTransform CameraAt(double after_s, const RigidTransform& T_body_camera,
                        const BodyMotion& motion) {
  return motion.At(after_s) * T_body_camera;
}

}  // namespace

RowTimes::RowTimes(const Rig& given, const Rig& rectified, bool estimates)
    : at_once_(IsTakenAtOnce(given) && !estimates), given_(given) {
  for (size_t c = 0; c < given.T_imu_camera.size(); ++c) {
    R_camera_rectified_.push_back(given.T_imu_camera[c].rotation.conjugate() *
                                  rectified.T_imu_camera[c].rotation);
  }
  given_.masks.clear();
}

double RowTimes::reach_s() const {
  double reach_s = 0;
  for (size_t c = 0; c < given_.readout_s.size(); ++c) {
    const double offset_s = std::abs(TimeOffset_s(given_, static_cast<int>(c)));
    reach_s = std::max(reach_s, offset_s + 0.5 * std::abs(given_.readout_s[c]));
  }
  return reach_s;
}

TimedPlace RowTimes::Of(int camera, const Vector2d& on_plane) const {
  const Camera& lens = given_.cameras[camera];
  const auto pixel = lens.Project(R_camera_rectified_[camera] * on_plane.homogeneous());
  const double row_px = pixel ? pixel->y() : 0.5 * (lens.height_px - 1);
  return {on_plane, RowTime_s(given_, camera, row_px), (row_px + 0.5) / lens.height_px - 0.5};
}

double RowTimes::LooksAhead_s() const { return at_once_ ? 0 : std::max(reach_s(), kFeltAround_s); }

std::vector<TimedPlace> RowTimes::Of(const Vector2d& left, const std::optional<Vector2d>& right,
                                     int camera) const {
  if (at_once_) return {};
  if (!right) return {Of(camera, left)};
  return {Of(camera, left), Of(camera + 1, *right)};
}

std::vector<TimedPlace> RowTimes::Of(const LineSegment& left,
                                     const std::optional<LineSegment>& right, int camera) const {
  if (at_once_) return {};
  if (!right) return {Of(camera, left.start), Of(camera, left.end)};
  return {Of(camera, left.start), Of(camera, left.end), Of(camera + 1, right->start),
          Of(camera + 1, right->end)};
}

FeltMotion FeltAround(const ImuBuffer& imu, int64_t stamp_ns, double reach_s) {
  const int64_t reach_ns = ToNanoseconds(std::max(reach_s, kFeltAround_s));
  const std::vector<ImuSample> samples = imu.Between(stamp_ns - reach_ns, stamp_ns + reach_ns);
  FeltMotion felt;
  if (samples.size() < 2) return felt;
  double mean_s = 0, square_s2 = 0;
  for (const ImuSample& sample : samples) {
    mean_s += ToSeconds(sample.stamp_ns - stamp_ns);
    felt.rate_rad_s += sample.angular_velocity_rad_s;
    felt.force_m_s2 += sample.specific_force_m_s2;
  }
  const double share = 1 / static_cast<double>(samples.size());
  mean_s *= share;
  felt.rate_rad_s *= share;
  felt.force_m_s2 *= share;
  for (const ImuSample& sample : samples) {
    const double t_s = ToSeconds(sample.stamp_ns - stamp_ns) - mean_s;
    felt.rate_change_rad_s2 += t_s * (sample.angular_velocity_rad_s - felt.rate_rad_s);
    square_s2 += t_s * t_s;
  }
  felt.rate_change_rad_s2 /= square_s2;
  felt.rate_rad_s -= mean_s * felt.rate_change_rad_s2;
  return felt;
}

RigidTransform BodyMotion::At(double after_s) const {
  const double half_s2 = 0.5 * after_s * after_s;
  return {ExpRotation(after_s * rate_rad_s + half_s2 * rate_change_rad_s2),
          after_s * velocity_m_s + half_s2 * acceleration_m_s2};
}

std::optional<Vector2d> AtMoment(const TimedPlace& measured, const RigidTransform& T_body_camera,
                                 const BodyMotion& motion, const Vector3d& p_body) {
  const Vector3d then = T_body_camera.Inverse() * p_body;
  const Vector3d seen = CameraAt(measured.after_s, T_body_camera, motion).Inverse() * p_body;
  if (then.z() < kNearest_m || seen.z() < kNearest_m) return std::nullopt;
  return measured.on_plane + then.hnormalized() - seen.hnormalized();
}

Vector2d AtMoment(const TimedPlace& measured, const RigidTransform& T_body_camera,
                  const BodyMotion& motion, double inverse_depth_per_m) {
  const RigidTransform T =
      T_body_camera.Inverse() * CameraAt(measured.after_s, T_body_camera, motion);
  const Vector3d ray =
      T.rotation * measured.on_plane.homogeneous() + inverse_depth_per_m * T.translation;
  return ray.z() > kNearest_m ? Vector2d(ray.hnormalized()) : measured.on_plane;
}

double InverseDepth(const TimedPlace& left, const TimedPlace& right,
                    const RigidTransform& T_body_left, const RigidTransform& T_body_right,
                    const BodyMotion& motion) {
  const RigidTransform T_right_left = CameraAt(right.after_s, T_body_right, motion).Inverse() *
                                      CameraAt(left.after_s, T_body_left, motion);
  // (u x (ray + lambda offset)) = 0.
  const Vector3d u = right.on_plane.homogeneous();
  const Vector3d a = u.cross(T_right_left.rotation * left.on_plane.homogeneous());
  const Vector3d b = u.cross(T_right_left.translation);
  const double square = b.squaredNorm();
  return square > 0 ? std::clamp(-a.dot(b) / square, 0.0, kNearest_per_m) : 0;
}

}  // namespace slcmap::odometry
