#include "odometry/window/window_state.h"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "odometry/geometry/pinhole.h"

namespace slcmap::inline odometry {

ImuCut MakeCut(const ImuBuffer& imu, int64_t stamp_ns, int64_t offset_ns) {
  constexpr int64_t kAveraged_ns = 20'000'000;
  return {offset_ns, imu.MeanRate(stamp_ns + offset_ns, kAveraged_ns)};
}

std::vector<LineLandmark*> CollectLines(const PointLandmark& landmark, WindowState* window) {
  std::vector<LineLandmark*> lines;
  for (auto& [id, line] : window->lines) {
    if (!line.estimated || line.retired || !line.IsStructural()) continue;
    if (std::find(line.points.begin(), line.points.end(), landmark.id) != line.points.end()) {
      lines.push_back(&line);
    }
  }
  return lines;
}

RigidTransform WorldFromHost(const PointLandmark& landmark, const StereoGeometry& geometry) {
  return landmark.host()->T_world_imu() * geometry.T_imu_camera[landmark.camera];
}

Eigen::Vector3d LandmarkInWorld(const PointLandmark& landmark, const StereoGeometry& geometry) {
  const Eigen::Vector3d p_camera =
      Eigen::Vector3d(landmark.point[0], landmark.point[1], 1) / landmark.inverse_depth_per_m();
  return landmark.host()->T_world_imu() * (geometry.T_imu_camera[landmark.camera] * p_camera);
}

void LineExtent::Add(double from_m, double to_m) {
  if (from_m < from_m_[0]) std::swap(from_m_[0], from_m);
  from_m_[1] = std::min(from_m_[1], from_m);
  if (to_m > to_m_[0]) std::swap(to_m_[0], to_m);
  to_m_[1] = std::max(to_m_[1], to_m);
}

void LineExtent::Add(const LineExtent& other, double along_m) {
  for (size_t i = 0; i < 2; ++i) Add(other.from_m_[i] + along_m, other.to_m_[i] + along_m);
}

PointAndDirection LineLandmark::InWorld() const {
  if (!IsExact()) return GeneralLineFromBlock(anchor_world, block.data());
  return {CrossingPoint(structural(), heading_rad(), block.data()),
          AxisDirection(axis, heading_rad())};
}

Eigen::Vector3d LineLandmark::AxisInWorld() const {
  return slope ? SlopeDirection(slope->angles_rad.data()) : AxisDirection(axis, heading_rad());
}

Matrix32d LineLandmark::AcrossAxisInWorld() const {
  return slope ? AxesAcrossSlope(slope->angles_rad.data()) : AxesAcross(axis, heading_rad());
}

std::vector<std::optional<double>> CollectHeadings(const WindowState& window) {
  std::vector<std::optional<double>> headings;
  for (const HeadingState& heading : window.headings) {
    headings.push_back(heading.withdrawn ? std::nullopt : std::optional(heading.heading_rad[0]));
  }
  return headings;
}

namespace {

bool WasSeenBefore(const WindowState& window, int64_t id) {
  const auto landmark = window.landmarks.find(id);
  return landmark != window.landmarks.end() &&
         landmark->second.frames.size() + landmark->second.released_frames > 1;
}

}  // namespace

bool KeptPoints::AreFewerThan(double share) const {
  constexpr double kUnproven = 0.5;  // of the share that is asked for, where all points count
  return proven_kept < share * proven || kept < kUnproven * share * all;
}

KeptPoints CountKept(const WindowState& window, const FrameState& frame,
                     const std::optional<std::unordered_set<int64_t>>& followed) {
  KeptPoints points;
  for (const auto& [id, measurement] : window.frames.back()->measurements) {
    const bool proven =
        WasSeenBefore(window, id) || (measurement.right && followed && followed->contains(id));
    const bool kept = frame.measurements.contains(id);
    ++points.all;
    if (kept) ++points.kept;
    if (proven) ++points.proven;
    if (proven && kept) ++points.proven_kept;
  }
  return points;
}

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

// Cuts a segment to the image; false where nothing of it is inside.
bool ClipToImage(const Camera& camera, LineSegment* segment) {
  const Vector2d along = segment->end - segment->start;
  const Vector2d limit(camera.width_px - 1, camera.height_px - 1);
  double from = 0, to = 1;
  for (int i = 0; i < 2; ++i) {
    double enters = -segment->start[i], leaves = limit[i] - segment->start[i];
    if (along[i] == 0) {
      if (enters > 0 || leaves < 0) return false;
      continue;
    }
    enters /= along[i];
    leaves /= along[i];
    from = std::max(from, std::min(enters, leaves));
    to = std::min(to, std::max(enters, leaves));
  }
  if (from >= to) return false;
  *segment = {segment->start + from * along, segment->start + to * along};
  return true;
}

// The segment in pixels of a camera where a part of a line in the world appears; nothing where less
// than a minimum of it is in the image.
std::optional<LineSegment> Project(Vector3d from_world, Vector3d to_world,
                                   const RigidTransform& T_world_camera, const Camera& camera) {
  constexpr double kNear_m = 0.2, kMinLength_px = 15;
  const RigidTransform T_camera_world = T_world_camera.Inverse();
  Vector3d a = T_camera_world * from_world, b = T_camera_world * to_world;
  if (a.z() < kNear_m && b.z() < kNear_m) return std::nullopt;
  const auto bring_forward = [&](Vector3d* behind, const Vector3d& front) {
    if (behind->z() >= kNear_m) return;
    *behind += (kNear_m - behind->z()) / (front.z() - behind->z()) * (front - *behind);
  };
  bring_forward(&a, b);
  bring_forward(&b, a);
  const auto pixel = [&](const Vector3d& p) {
    return Vector2d(camera.fx_px * p.x() / p.z() + camera.cx_px,
                    camera.fy_px * p.y() / p.z() + camera.cy_px);
  };
  LineSegment segment{pixel(a), pixel(b)};
  if (!ClipToImage(camera, &segment) || segment.Length() < kMinLength_px) {
    return std::nullopt;
  }
  return segment;
}

}  // namespace

std::vector<LinePrediction> PredictLines(const WindowState& window, const FrameState& frame,
                                         const Rig& rectified_rig) {
  constexpr double kSigma_px = 1.5;  // mostly of the pose that the points alone have found
  std::vector<LinePrediction> out;
  std::set<int> left_cameras;
  for (const auto& [camera, is_pair] : CameraGroups(rectified_rig)) {
    if (is_pair) left_cameras.insert(camera);
  }
  for (const auto& [id, line] : window.lines) {
    if (!line.estimated || line.retired || line.finished || line.extent.empty()) continue;
    const PointAndDirection in_world = line.InWorld();
    const Vector3d from = in_world.point_world + line.extent.from_m() * in_world.direction_world;
    const Vector3d to = in_world.point_world + line.extent.to_m() * in_world.direction_world;
    const auto seen = [&](int camera) {
      return Project(from, to, frame.T_world_imu() * rectified_rig.T_imu_camera[camera],
                     rectified_rig.cameras[camera]);
    };
    const auto left = seen(line.camera);
    const auto right = left_cameras.contains(line.camera) ? seen(line.camera + 1) : std::nullopt;
    if (left) out.push_back({id, *left, right, kSigma_px, line.camera});
  }
  return out;
}

std::vector<Vector3d> AxesInCamera(const WindowState& window, const FrameState& frame,
                                   const Rig& rectified_rig) {
  std::vector<Vector3d> axes;
  const Eigen::Quaterniond R_camera_world =
      (frame.T_world_imu().rotation * rectified_rig.T_imu_camera[0].rotation).conjugate();
  axes.push_back(R_camera_world * Vector3d::UnitZ());
  for (const HeadingState& heading : window.headings) {
    if (heading.withdrawn) continue;
    for (const LineAxis axis : {LineAxis::kX, LineAxis::kY}) {
      axes.push_back(R_camera_world * AxisDirection(axis, heading.heading_rad[0]));
    }
  }
  for (const SlopeState& slope : window.slopes) {
    if (slope.withdrawn) continue;
    axes.push_back(R_camera_world * SlopeDirection(slope.angles_rad.data()));
  }
  return axes;
}

std::vector<LineObservation> LinesInPixels(const FrameState& frame, const Camera& camera) {
  std::vector<LineObservation> lines;
  for (const auto& [id, measurement] : frame.lines) {
    LineObservation& line = lines.emplace_back();
    line.id = id;
    line.left_px = PixelFromPlane(camera, measurement.left);
    if (measurement.right) line.right_px = PixelFromPlane(camera, *measurement.right);
    line.camera = measurement.camera;
  }
  return lines;
}

}  // namespace slcmap::odometry
