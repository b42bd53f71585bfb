#include "data/simulator/edge_visibility.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "data/error.h"
#include "data/file.h"
#include "data/ply.h"

namespace slcmap {
namespace {

constexpr int64_t kEdgeMaxSamples = 20'000'000;

// Of the origin from a segment.
double Distance(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d d = b - a;
  const double length2 = d.squaredNorm();
  const double u = length2 > 0 ? std::clamp(-a.dot(d) / length2, 0.0, 1.0) : 0.0;
  return (a + u * d).norm();
}

bool IsSet(uint8_t& flag) { return std::atomic_ref(flag).load(std::memory_order_relaxed) != 0; }
void Set(uint8_t& flag, uint8_t value) {
  std::atomic_ref(flag).store(value, std::memory_order_relaxed);
}

}  // namespace

void EdgeVisibilityOptions::Check() const {
  if (!(sample_m > 0)) throw ConfigError("edges: sample_m: expected more than 0");
  if (!(interval_s >= 0)) throw ConfigError("edges: interval_s: expected zero or more");
  if (!(margin_m >= 0 && range_m > margin_m)) {
    throw ConfigError("edges: range_m: expected more than margin_m, and that not negative");
  }
}

EdgeWatch::EdgeWatch(const Scene& scene, const RayScene& rays, const RenderTask& task,
                     const EdgeVisibilityOptions& options)
    : scene_(scene), rays_(rays), task_(task), options_(options) {
  int64_t samples = 0;
  for (const TrueEdge& edge : scene.edges) {
    const double length_m = (edge.b - edge.a).norm();
    const int64_t count = std::max(1l, std::lround(length_m / options.sample_m));
    samples += count;
    if (samples > kEdgeMaxSamples) {
      throw ConfigError(
          fmt::format("scene: found edges of more than {:.0f} m in all, "
                      "expected at most that: make it smaller",
                      static_cast<double>(kEdgeMaxSamples) * options.sample_m));
    }
    seen_.emplace_back(count, 0);
  }
  double next_s = 0;
  for (const double t_s : task.times_s) {
    is_due_.push_back(t_s >= next_s);
    if (is_due_.back()) next_s = t_s + options.interval_s;
  }
}

void EdgeWatch::Look(int frame) {
  if (!IsSet(is_due_[frame])) return;
  const RigidTransform T_world_imu = task_.motion.PoseAt(task_.times_s[frame]);
  for (int c = 0; c < 2; ++c) {
    LookThrough(task_.rig.cameras[c], T_world_imu * task_.rig.T_imu_camera[c]);
  }
  Set(is_due_[frame], 0);
}

void EdgeWatch::LookThrough(const Camera& camera, const RigidTransform& T_world_camera) {
  const RigidTransform T_camera_world = T_world_camera.Inverse();
  for (size_t e = 0; e < seen_.size(); ++e) {
    if (task_.stop.stop_requested()) throw StoppedError("interrupted");
    const TrueEdge& edge = scene_.edges[e];
    const Eigen::Vector3d a = T_camera_world * edge.a, b = T_camera_world * edge.b;
    if (Distance(a, b) > options_.range_m) continue;
    for (size_t i = 0; i < seen_[e].size(); ++i) {
      if (IsSet(seen_[e][i])) continue;
      const double along = (static_cast<double>(i) + 0.5) / static_cast<double>(seen_[e].size());
      if (Sees(camera, a + along * (b - a), T_world_camera)) Set(seen_[e][i], 1);
    }
  }
}

bool EdgeWatch::Sees(const Camera& camera, const Eigen::Vector3d& p_camera,
                     const RigidTransform& T_world_camera) const {
  const double distance_m = p_camera.norm();
  if (distance_m > options_.range_m || distance_m <= options_.margin_m) return false;
  const auto pixel = camera.Project(p_camera);
  if (!pixel || !camera.Contains(*pixel)) return false;
  const Eigen::Vector3d ray = T_world_camera.rotation * (p_camera / distance_m);
  return !rays_.Blocked(T_world_camera.translation.cast<float>(), ray.cast<float>(),
                        static_cast<float>(distance_m - options_.margin_m));
}

std::vector<SeenPart> EdgeWatch::Parts() const {
  std::vector<SeenPart> parts;
  for (size_t e = 0; e < seen_.size(); ++e) {
    const double length_m = (scene_.edges[e].b - scene_.edges[e].a).norm();
    const double step_m = length_m / static_cast<double>(seen_[e].size());
    for (size_t i = 0; i < seen_[e].size(); ++i) {
      if (!seen_[e][i]) continue;
      const size_t first = i;
      while (i < seen_[e].size() && seen_[e][i]) ++i;
      parts.push_back({static_cast<int>(e), step_m * static_cast<double>(first),
                       step_m * static_cast<double>(i)});
    }
  }
  return parts;
}

void WriteEdges(const std::string& folder, const Scene& scene, const std::vector<SeenPart>& seen) {
  std::vector<PlySegment> segments;
  std::vector<std::vector<SeenPart>> parts(scene.edges.size());
  for (const SeenPart& part : seen) {
    const TrueEdge& edge = scene.edges[part.edge];
    const Eigen::Vector3d direction = (edge.b - edge.a).normalized();
    segments.push_back({edge.a + part.from_m * direction, edge.a + part.to_m * direction});
    parts[part.edge].push_back(part);
  }
  // Pieces of bent edges are short: their directions need more.
  const int decimals = scene.inexact ? 6 : 4;
  std::string rows = "edge,axis,wing,ax_m,ay_m,az_m,bx_m,by_m,bz_m,seen_from_m,seen_to_m\n";
  for (size_t e = 0; e < scene.edges.size(); ++e) {
    const TrueEdge& edge = scene.edges[e];
    if (parts[e].empty()) parts[e].push_back({static_cast<int>(e), 0, 0});
    const int number = edge.bent_edge >= 0 ? edge.bent_edge : static_cast<int>(e);
    for (const SeenPart& part : parts[e]) {
      rows += fmt::format("{},{},{}", number, edge.axis, edge.wing);
      for (const double value : {edge.a.x(), edge.a.y(), edge.a.z(), edge.b.x(), edge.b.y(),
                                 edge.b.z(), part.from_m, part.to_m}) {
        rows += fmt::format(",{:.{}f}", value, decimals);
      }
      rows += "\n";
    }
  }
  WriteLinesPly(folder + "/edges.ply", segments);
  WriteFile(folder + "/edges.csv", rows);
}

}  // namespace slcmap
