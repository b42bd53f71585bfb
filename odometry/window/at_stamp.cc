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
        readout_change_s_(model.readout_change_s),
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
    point->left = Place(point->timed[0], point->camera, p_body, depth);
    if (point->right) point->right = Place(point->timed[1], point->camera + 1, p_body, depth);
  }

  void Bring(int64_t id, StereoLineMeasurement* line) const {
    if (line->timed.empty()) return;
    std::optional<PointAndDirection> in_world;
    const auto known = window_.lines.find(id);
    if (known != window_.lines.end() && known->second.estimated) in_world = known->second.InWorld();
    const auto place = [&](size_t seen, size_t end) {
      const TimedPlace& timed = line->timed[2 * seen + end];
      const int camera = line->camera + static_cast<int>(seen);
      return Place(timed, camera, OnLine(in_world, timed, camera), usual_per_m_);
    };
    line->left = {place(0, 0), place(0, 1)};
    if (line->right) line->right = LineSegment{place(1, 0), place(1, 1)};
  }

  // How the place at the stamp moves with the readout, of a point that is known; else nothing.
  std::optional<Vector2d> ByReadout(int64_t id, const TimedPlace& timed, int camera) const {
    constexpr double kStep_s = 1e-4;
    const std::optional<Vector3d> p_body = PointInBody(id);
    if (!p_body) return std::nullopt;
    return (Place(timed.WithReadoutLonger(kStep_s), camera, p_body, 0) -
            Place(timed.WithReadoutLonger(-kStep_s), camera, p_body, 0)) /
           (2 * kStep_s);
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

  Vector2d Place(const TimedPlace& given, int camera, const std::optional<Vector3d>& p_body,
                 double inverse_depth_per_m) const {
    const TimedPlace timed = AsKnown(given);
    const RigidTransform& T_body_camera = geometry_.T_imu_camera[camera];
    std::optional<Vector2d> place;
    if (p_body) place = AtMoment(timed, T_body_camera, motion_, *p_body);
    return place ? *place : AtMoment(timed, T_body_camera, motion_, inverse_depth_per_m);
  }

  const WindowState& window_;
  const StereoGeometry& geometry_;
  double readout_change_s_;
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

ReadoutEstimate::ReadoutEstimate(double sigma_s)
    : given_per_s2_(sigma_s > 0 ? 1 / (sigma_s * sigma_s) : 0),
      information_per_s2_(given_per_s2_) {}

void ReadoutEstimate::Improve(const WindowState& window, CostModel* model) {
  // States follow a readout that was wrong: each keyframe tells but a part of what is left of it.
  constexpr double kKept = 0.5;
  if (given_per_s2_ == 0) return;
  const FrameState& frame = *window.frames.back();
  const FrameAtStamp at_stamp(window, *model, frame);
  Eigen::Matrix<double, 7, 7> information = Eigen::Matrix<double, 7, 7>::Identity();
  Eigen::Matrix<double, 7, 1> gradient = Eigen::Matrix<double, 7, 1>::Zero();
  for (const auto& [id, measurement] : frame.measurements) {
    const auto known = window.landmarks.find(id);
    if (known == window.landmarks.end() || !known->second.triangulated) continue;
    if (known->second.host() == &frame || measurement.timed.empty()) continue;
    const FixedTerm term = FixedPointTerm(known->second, frame, *model);
    Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor> by_pose(term.factor->rows(), 6);
    Eigen::VectorXd residual(term.factor->rows());
    std::array<double*, Factor::kMaxBlocks> jacobians{};
    jacobians[1] = by_pose.data();
    term.factor->Linearize(term.blocks.data(), residual.data(), jacobians.data());
    for (int camera = 0; 2 * camera < term.factor->rows(); ++camera) {
      const auto by_readout =
          at_stamp.ByReadout(id, measurement.timed[camera], measurement.camera + camera);
      if (!by_readout) continue;
      Eigen::Matrix<double, 2, 7> row;
      row << by_pose.middleRows<2>(2 * camera), -model->geometry.weight * *by_readout;
      const Vector2d r = residual.segment<2>(2 * camera);
      const double weight = 1 / std::max(1.0, r.norm());  // Huber's
      information += weight * row.transpose() * row;
      gradient += weight * row.transpose() * r;
    }
  }
  const auto of_pose = information.topLeftCorner<6, 6>().ldlt();
  const Eigen::Matrix<double, 6, 1> coupling = information.topRightCorner<6, 1>();
  const double known_per_s2 = information(6, 6) - coupling.dot(of_pose.solve(coupling));
  const double slope = gradient[6] - coupling.dot(of_pose.solve(gradient.head<6>()));
  information_per_s2_ =
      std::max(given_per_s2_, kKept * information_per_s2_) + std::max(0.0, known_per_s2);
  model->readout_change_s -= slope / information_per_s2_;
}

}  // namespace slcmap::odometry
