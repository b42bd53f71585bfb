// Images whose rows are not exposed at the stamp of their pair (rolling shutters, cameras that are
// not triggered together): when a row was, how the rig moved meanwhile, and where in the image what
// it shows was at the stamp.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "data/core/rigid_transform.h"
#include "data/core/types.h"
#include "odometry/geometry/imu.h"

namespace slcmap::inline odometry {

// A place on the plane z = 1 of a rectified camera as it was measured, and how long after the stamp
// of its pair; were the readout longer, by that share of it later.
struct TimedPlace {
  Eigen::Vector2d on_plane = Eigen::Vector2d::Zero();
  double after_s = 0;
  double readout_share = 0;
  // How where it was at the stamp moves with the readout, 1 / s; set where that is estimated.
  Eigen::Vector2d by_readout_per_s = Eigen::Vector2d::Zero();

  TimedPlace WithReadoutLonger(double by_s) const {
    TimedPlace longer = *this;
    longer.after_s += by_s * readout_share;
    return longer;
  }
};

// When rows are exposed, of places in rectified images.
class RowTimes {
 public:
  RowTimes() = default;  // all at the stamp
  // `estimates`: rows may be exposed at other times than is given.
  RowTimes(const Rig& given, const Rig& rectified, bool estimates = false);

  bool at_once() const { return at_once_; }
  // How far from the stamp rows are exposed, at most.
  double reach_s() const;
  double right_offset_s() const { return given_.right_time_offset_s; }

  // For how long after a stamp IMU samples have to be there; 0 where all is exposed at it.
  double LooksAhead_s() const;

  TimedPlace Of(int camera, const Eigen::Vector2d& on_plane) const;
  // Of a point and of a segment's ends, left (of the camera that is given) and (where seen) right
  // (of the next one); none where all is exposed at the stamp.
  std::vector<TimedPlace> Of(const Eigen::Vector2d& left,
                             const std::optional<Eigen::Vector2d>& right, int camera = 0) const;
  std::vector<TimedPlace> Of(const LineSegment& left, const std::optional<LineSegment>& right,
                             int camera = 0) const;

 private:
  bool at_once_ = true;
  Rig given_;
  std::vector<Eigen::Quaterniond> R_camera_rectified_;
};

// What the IMU read around a stamp; the rate is linear in time.
struct FeltMotion {
  Eigen::Vector3d rate_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d rate_change_rad_s2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d force_m_s2 = Eigen::Vector3d::Zero();
};

// How far from the stamp FeltAround() looks, at least: its samples have to be there.
inline constexpr double kFeltAround_s = 0.02;

FeltMotion FeltAround(const ImuBuffer& imu, int64_t stamp_ns, double reach_s);

// How a body moves about a moment, in its own axes then.
struct BodyMotion {
  Eigen::Vector3d rate_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d rate_change_rad_s2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration_m_s2 = Eigen::Vector3d::Zero();

  // The body so much later, in the body at the moment.
  RigidTransform At(double after_s) const;
};

// Where a camera had measured a point of the body's frame at the moment: its residual there is that
// of the measurement at its own time. Nothing where the point is not before the camera.
std::optional<Eigen::Vector2d> AtMoment(const TimedPlace& measured,
                                        const RigidTransform& T_body_camera,
                                        const BodyMotion& motion, const Eigen::Vector3d& p_body);

// The same of a point of which an inverse depth is known (1 / m, when it was measured).
Eigen::Vector2d AtMoment(const TimedPlace& measured, const RigidTransform& T_body_camera,
                         const BodyMotion& motion, double inverse_depth_per_m);

// The inverse depth (1 / m) of what both cameras measured, each at its time; at least 0.
double InverseDepth(const TimedPlace& left, const TimedPlace& right,
                    const RigidTransform& T_body_left, const RigidTransform& T_body_right,
                    const BodyMotion& motion);

}  // namespace slcmap::odometry
