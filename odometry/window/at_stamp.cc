#include "odometry/window/at_stamp.h"

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "data/core/math.h"
#include "odometry/geometry/imu.h"

namespace slcmap::inline odometry {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// The point of a line that is nearest to a ray; nothing where the two are nearly parallel.
std::optional<Vector3d> NearestOnLine(const PointAndDirection& line, const Vector3d& centre,
                                      const Vector3d& ray) {
  constexpr double kMinSquaredSine = 1e-3;
  const Vector3d between = line.point_world - centre;
  const double cosine = line.direction_world.dot(ray);
  const double squared_sine = 1 - cosine * cosine;
  if (squared_sine < kMinSquaredSine) return std::nullopt;
  const double along_m =
      (cosine * ray.dot(between) - line.direction_world.dot(between)) / squared_sine;
  return line.point_world + along_m * line.direction_world;
}

// What a frame needs to bring its measurements to its stamp.
class FrameAtStamp {
 public:
  FrameAtStamp(const WindowState& window, const CostModel& model, const FrameState& frame)
      : window_(window),
        geometry_(model.geometry),
        readout_change_s_(model.readout ? *model.readout : 0),
        estimates_readout_(model.readout),
        motion_(GetMotion(frame, *model.calibration)),
        T_world_body_(frame.T_world_imu()) {
    std::vector<double> depths;
    for (const auto& [id, point] : frame.measurements) {
      if (const auto depth = StereoDepth(point)) depths.push_back(*depth);
    }
    usual_per_m_ = Quantile(std::move(depths), 0.5);
  }

  void Bring(int64_t id, StereoMeasurement* point) const {
    if (point->timed.empty()) return;
    const std::optional<Vector3d> p_body = PointInBody(id);
    const double depth = StereoDepth(*point).value_or(usual_per_m_);
    point->left = Place(&point->timed[0], point->camera, p_body, depth);
    if (point->right) point->right = Place(&point->timed[1], point->camera + 1, p_body, depth);
  }

  void Bring(int64_t id, StereoLineMeasurement* line) const {
    if (line->timed.empty()) return;
    std::optional<PointAndDirection> in_world;
    const auto known = window_.lines.find(id);
    if (known != window_.lines.end() && known->second.estimated) in_world = known->second.InWorld();
    const auto place = [&](size_t seen, size_t end) {
      TimedPlace* timed = &line->timed[2 * seen + end];
      const int camera = line->camera + static_cast<int>(seen);
      return Place(timed, camera, OnLine(in_world, *timed, camera), usual_per_m_);
    };
    line->left = {place(0, 0), place(0, 1)};
    if (line->right) line->right = LineSegment{place(1, 0), place(1, 1)};
  }

 private:
  std::optional<double> StereoDepth(const StereoMeasurement& point) const {
    if (point.timed.size() < 2 || !point.right) return std::nullopt;
    return InverseDepth(AsKnown(point.timed[0]), AsKnown(point.timed[1]),
                        geometry_.T_imu_camera[point.camera],
                        geometry_.T_imu_camera[point.camera + 1], motion_);
  }

  TimedPlace AsKnown(const TimedPlace& timed) const {
    return timed.WithReadoutLonger(readout_change_s_);
  }

  std::optional<Vector3d> PointInBody(int64_t id) const {
    const auto known = window_.landmarks.find(id);
    if (known == window_.landmarks.end() || !known->second.triangulated) return std::nullopt;
    return T_world_body_.Inverse() * LandmarkInWorld(known->second, geometry_);
  }

  // The point of the line, in the body, that a place in an image shows.
  std::optional<Vector3d> OnLine(const std::optional<PointAndDirection>& line,
                                 const TimedPlace& timed, int camera) const {
    if (!line) return std::nullopt;
    const RigidTransform T_world_camera =
        T_world_body_ * motion_.At(AsKnown(timed).after_s) * geometry_.T_imu_camera[camera];
    const Vector3d ray = T_world_camera.rotation * timed.on_plane.homogeneous().normalized();
    const auto p_world = NearestOnLine(*line, T_world_camera.translation, ray);
    if (!p_world) return std::nullopt;
    return T_world_body_.Inverse() * *p_world;
  }

  // At the stamp; says in `given` how that moves with the readout, where this is estimated.
  Vector2d Place(TimedPlace* given, int camera, const std::optional<Vector3d>& p_body,
                 double inverse_depth_per_m) const {
    constexpr double kStep_s = 1e-4;
    const RigidTransform& T_body_camera = geometry_.T_imu_camera[camera];
    const auto place = [&](double longer_s) {
      const TimedPlace timed = AsKnown(*given).WithReadoutLonger(longer_s);
      std::optional<Vector2d> at;
      if (p_body) at = AtMoment(timed, T_body_camera, motion_, *p_body);
      return at ? *at : AtMoment(timed, T_body_camera, motion_, inverse_depth_per_m);
    };
    if (estimates_readout_) {
      given->by_readout_per_s = (place(kStep_s) - place(-kStep_s)) / (2 * kStep_s);
    }
    return place(0);
  }

  const WindowState& window_;
  const StereoGeometry& geometry_;
  double readout_change_s_;
  bool estimates_readout_;
  BodyMotion motion_;
  RigidTransform T_world_body_;
  double usual_per_m_ = 0;  // inverse depth of what the frame shows
};

bool IsTimed(const FrameState& frame) {
  if (!frame.measurements.empty()) return !frame.measurements.begin()->second.timed.empty();
  return !frame.lines.empty() && !frame.lines.begin()->second.timed.empty();
}

}  // namespace

BodyMotion GetMotion(const FrameState& frame, const CalibrationState& calibration) {
  const double* imu = calibration.imu.data();
  const ImuCorrection correction = MakeCorrection(GetErrors(imu));
  const Eigen::Quaterniond R_body_imu = BodyFromImu(imu).rotation;
  const Eigen::Quaterniond R_body_world = frame.T_world_imu().rotation.conjugate();
  const FeltMotion& felt = frame.felt;
  // The moment is that of the exposure, as its time is estimated.
  const Vector3d rate_rad_s = felt.rate_rad_s + imu[kRowTimeOffset] * felt.rate_change_rad_s2;
  return {R_body_imu * (correction.gyro * rate_rad_s - frame.gyro_bias()),
          R_body_imu * (correction.gyro * felt.rate_change_rad_s2), R_body_world * frame.velocity(),
          R_body_imu * (correction.accel * felt.force_m_s2 - frame.accel_bias()) +
              R_body_world * Vector3d(0, 0, -kGravity_m_s2)};
}

void BringToStamp(const WindowState& window, const CostModel& model, FrameState* frame) {
  if (!IsTimed(*frame)) return;
  const FrameAtStamp at_stamp(window, model, *frame);
  for (auto& [id, point] : frame->measurements) at_stamp.Bring(id, &point);
  for (auto& [id, line] : frame->lines) at_stamp.Bring(id, &line);
}

void BringToStamps(const CostModel& model, WindowState* window) {
  for (auto& frame : window->frames) BringToStamp(*window, model, frame.get());
}

}  // namespace slcmap::odometry
