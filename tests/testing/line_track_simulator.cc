#include "tests/testing/line_track_simulator.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kNear_m = 0.2;  // nothing nearer is seen

// Shortens the segment a + t (b - a), t from 0 to 1, to where value >= 0, given value at both ends.
void Keep(double at_a, double at_b, double* from, double* to) {
  const double crossing = at_a / (at_a - at_b);
  if (at_a < 0) *from = at_b < 0 ? 1 : std::max(*from, crossing);
  if (at_b < 0) *to = at_a < 0 ? 0 : std::min(*to, crossing);
}

// The part of the segment from a to b where all of `values` (of two points) are positive.
template <typename Point, typename Values>
bool Clip(const Values& values, Point* a, Point* b) {
  double from = 0, to = 1;
  const auto at_a = values(*a), at_b = values(*b);
  for (int k = 0; k < at_a.size(); ++k) Keep(at_a[k], at_b[k], &from, &to);
  if (!(from < to)) return false;
  const Point start = *a, along = *b - *a;
  *a = start + from * along;
  *b = start + to * along;
  return true;
}

class LineTrackSimulator {
 public:
  LineTrackSimulator(const Rig& rig, const LineTrackSimulatorOptions& options,
                     SimulatedTracks* tracks)
      : rig_(rig), options_(options), tracks_(*tracks), generator_(options.seed) {}

  void Run() {
    for (SimulatedTrackFrame& frame : tracks_.frames) {
      std::erase_if(live_edges_, [&](int64_t id) { return !See(frame, tracks_.edges[id], 0); });
      TakeUpNew(frame);
      for (const int64_t id : live_edges_) frame.lines.push_back(Measure(frame, id));
      std::erase_if(live_points_, [&](int64_t id) { return !SeePoint(frame, id, 0); });
      for (const int64_t id : live_points_) frame.tracks.push_back(MeasurePoint(frame, id));
    }
  }

 private:
  // A nearer edge in front of another one.
  struct Crossing {
    int64_t edge = 0;
    Vector3d nearer_world, direction_world;
  };

  RigidTransform CameraFromWorld(const SimulatedTrackFrame& frame, int camera) const {
    return (frame.T_world_imu * rig_.T_imu_camera[camera]).Inverse();
  }

  // What a camera sees of an edge, without noise.
  std::optional<SimulatedSegment> See(const SimulatedTrackFrame& frame, const SimulatedEdge& edge,
                                      int camera) const {
    const Camera& model = rig_.cameras[camera];
    const RigidTransform T = CameraFromWorld(frame, camera);
    Vector3d a = T * edge.start_world, b = T * edge.end_world;
    const auto in_front = [](const Vector3d& p) {
      return Eigen::Matrix<double, 1, 1>(p.z() - kNear_m);
    };
    if (!Clip(in_front, &a, &b)) return std::nullopt;
    const auto pixel = [&](const Vector3d& p) {
      return Vector2d(model.fx_px * p.x() / p.z() + model.cx_px,
                      model.fy_px * p.y() / p.z() + model.cy_px);
    };
    SimulatedSegment seen{pixel(a), pixel(b)};
    const double margin = options_.margin_px;
    const auto in_image = [&](const Vector2d& p) {
      return Eigen::Vector4d(p.x() - margin, p.y() - margin, model.width_px - 1 - margin - p.x(),
                             model.height_px - 1 - margin - p.y());
    };
    if (!Clip(in_image, &seen.start_px, &seen.end_px)) return std::nullopt;
    if ((seen.end_px - seen.start_px).norm() < options_.min_length_px) return std::nullopt;
    return seen;
  }

  // Where the nearer edge of a crossing hides its edge from a camera; nothing where it does not.
  std::optional<Vector3d> HiddenPoint(const SimulatedTrackFrame& frame, const Crossing& crossing,
                                      int camera) const {
    const Vector3d centre = (frame.T_world_imu * rig_.T_imu_camera[camera]).translation;
    const SimulatedEdge& edge = tracks_.edges[crossing.edge];
    const Vector3d normal = (crossing.nearer_world - centre).cross(crossing.direction_world);
    const Vector3d along = edge.end_world - edge.start_world;
    const double share = normal.dot(centre - edge.start_world) / normal.dot(along);
    if (!(share >= 0 && share <= 1)) return std::nullopt;
    return edge.start_world + share * along;
  }

  std::optional<Vector2d> SeePoint(const SimulatedTrackFrame& frame, int64_t id, int camera) const {
    const auto crossing = crossings_.find(id);
    const std::optional<Vector3d> p_world = crossing == crossings_.end()
                                                ? tracks_.landmarks_world[id]
                                                : HiddenPoint(frame, crossing->second, camera);
    if (!p_world) return std::nullopt;
    const Vector3d p = CameraFromWorld(frame, camera) * *p_world;
    if (p.z() < kNear_m) return std::nullopt;
    std::optional<Vector2d> pixel = rig_.cameras[camera].Project(p);
    if (pixel && !rig_.cameras[camera].Contains(*pixel, options_.margin_px)) pixel.reset();
    return pixel;
  }

  void TakeUpNew(const SimulatedTrackFrame& frame) {
    for (int i = 0; i < 20 * options_.max_lines; ++i) {
      if (static_cast<int>(live_edges_.size()) >= options_.max_lines) return;
      const SimulatedEdge edge = PlaceEdge(frame);
      if (!See(frame, edge, 0)) continue;
      live_edges_.push_back(static_cast<int64_t>(tracks_.edges.size()));
      tracks_.edges.push_back(edge);
      AddPoints(&tracks_.edges.back());
      AddCrossings((frame.T_world_imu * rig_.T_imu_camera[0]).translation, live_edges_.back());
    }
  }

  // An edge whose middle is at a random pixel and depth of the left camera.
  SimulatedEdge PlaceEdge(const SimulatedTrackFrame& frame) {
    const Camera& left = rig_.cameras[0];
    const double x_px = Uniform(0, left.width_px - 1), y_px = Uniform(0, left.height_px - 1);
    const double depth_m = Uniform(options_.min_depth_m, options_.max_depth_m);
    const Vector3d middle =
        CameraFromWorld(frame, 0).Inverse() *
        (depth_m * Vector3d((x_px - left.cx_px) / left.fx_px, (y_px - left.cy_px) / left.fy_px, 1));
    SimulatedEdge edge;
    if (Uniform(0, 1) >= options_.general_share) {
      edge.is_sloped = options_.sloped_share > 0 && Uniform(0, 1) < options_.sloped_share;
      if (!edge.is_sloped) edge.axis = static_cast<int>(Uniform(0, 3));
    }
    const double length_m = Uniform(options_.max_length_m / 3, options_.max_length_m);
    const Vector3d half =
        0.5 * length_m * Deviating(edge.is_sloped ? Slope() : Direction(edge.axis));
    edge.start_world = middle - half;
    edge.end_world = middle + half;
    return edge;
  }

  Vector3d Direction(std::optional<int> axis) {
    const double c = std::cos(options_.heading_rad), s = std::sin(options_.heading_rad);
    if (axis == 0) return {c, s, 0};
    if (axis == 1) return {-s, c, 0};
    if (axis == 2) return Vector3d::UnitZ();
    return Normal3().normalized();
  }

  Vector3d Slope() const {
    const double level = std::cos(options_.slope_elevation_rad);
    return {level * std::cos(options_.slope_azimuth_rad),
            level * std::sin(options_.slope_azimuth_rad), std::sin(options_.slope_elevation_rad)};
  }

  Vector3d Deviating(const Vector3d& direction) {
    if (options_.deviation_rad == 0) return direction;
    const Vector3d off = options_.deviation_rad * Normal3();
    return (direction + off - off.dot(direction) * direction).normalized();
  }

  Vector3d Normal3() {
    const double x = normal_(generator_), y = normal_(generator_);
    return {x, y, normal_(generator_)};
  }

  // A landmark where there will be a track.
  int64_t AddLandmark(const Vector3d& p_world) {
    const auto id = static_cast<int64_t>(tracks_.landmarks_world.size());
    tracks_.landmarks_world.push_back(p_world);
    live_points_.push_back(id);
    return id;
  }

  void AddPoints(SimulatedEdge* edge) {
    const Vector3d along = edge->end_world - edge->start_world;
    for (int k = 0; k < options_.points_per_edge; ++k) {
      edge->landmarks.push_back(AddLandmark(edge->start_world + Uniform(0, 1) * along));
    }
  }

  // The nearer edges follow other axes of the building.
  void AddCrossings(const Vector3d& centre_world, int64_t edge_id) {
    SimulatedEdge& edge = tracks_.edges[edge_id];
    for (int k = 0; k < options_.crossings_per_edge; ++k) {
      const Vector3d hidden =
          edge.start_world + Uniform(0.2, 0.8) * (edge.end_world - edge.start_world);
      const int axis = (edge.axis.value_or(0) + 1 + static_cast<int>(Uniform(0, 2))) % 3;
      const int64_t id = AddLandmark(hidden);
      crossings_[id] = {edge_id, centre_world + Uniform(0.5, 0.95) * (hidden - centre_world),
                        Direction(axis)};
      edge.crossings.push_back(id);
    }
  }

  SimulatedLineTrack Measure(const SimulatedTrackFrame& frame, int64_t id) {
    const SimulatedEdge& edge = tracks_.edges[id];
    SimulatedLineTrack track{id, Disturbed(*See(frame, edge, 0)), See(frame, edge, 1)};
    if (track.right) track.right = Disturbed(*track.right);
    return track;
  }

  // Each end stops short of the true one, by a third of the length at most, and lies beside the
  // line.
  SimulatedSegment Disturbed(const SimulatedSegment& seen) {
    const Vector2d along = (seen.end_px - seen.start_px).normalized();
    const Vector2d across(-along.y(), along.x());
    const double most_px = (seen.end_px - seen.start_px).norm() / 3;
    const auto disturbance = [&](double sign) {
      const double short_px =
          std::min(most_px, options_.end_shift_px * std::abs(normal_(generator_)));
      const double beside_px = options_.sigma_px * normal_(generator_);
      return Vector2d(sign * short_px * along + beside_px * across);
    };
    const Vector2d start_px = seen.start_px + disturbance(1);
    return {start_px, seen.end_px + disturbance(-1)};
  }

  SimulatedTrack MeasurePoint(const SimulatedTrackFrame& frame, int64_t id) {
    const auto noise = [&] {
      const double x = normal_(generator_);
      return Vector2d(options_.sigma_px * Vector2d(x, normal_(generator_)));
    };
    SimulatedTrack track{id, *SeePoint(frame, id, 0), SeePoint(frame, id, 1)};
    track.left_px += noise();
    if (track.right_px) *track.right_px += noise();
    return track;
  }

  double Uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(generator_);
  }

  const Rig& rig_;
  const LineTrackSimulatorOptions& options_;
  SimulatedTracks& tracks_;
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
  std::vector<int64_t> live_edges_, live_points_;  // in ascending order
  std::map<int64_t, Crossing> crossings_;          // by landmark
};

}  // namespace

void AddLineTracks(const Rig& rig, const LineTrackSimulatorOptions& options,
                   SimulatedTracks* tracks) {
  LineTrackSimulator(rig, options, tracks).Run();
}

}  // namespace slcmap
