#include "apps/evaluation/clear_edges.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "apps/evaluation/seen_surfaces.h"
#include "data/option_table.h"

namespace slcmap {
namespace {

constexpr OptionTable kEdgesTable{
    Option{"min_length_m", &ClearSightOptions::min_length_m, 0.0, 1e3},
    Option{"max_range_m", &ClearSightOptions::max_range_m, 0.1, 1e3},
    Option{"min_frames", &ClearSightOptions::min_frames, 1, 1000000},
    Option{"interval_s", &ClearSightOptions::interval_s, 1e-3, 1e3},
    Option{"sample_m", &ClearSightOptions::sample_m, 1e-3, 10.0},
    Option{"margin_m", &ClearSightOptions::margin_m, 0.0, 0.1}};

double EdgeLength(const PlySegment& segment) {
  return (segment.end_world - segment.start_world).norm();
}

// Of those that are long enough; the pieces of a bent edge count as one.
std::vector<PlySegment> LongEdges(const TrueEdges& edges, double min_length_m) {
  const auto edge_of = [&](std::size_t i) {
    return edges.edge_of_whole.empty() ? static_cast<int64_t>(i) : edges.edge_of_whole[i];
  };
  std::map<int64_t, double> lengths_m;
  for (std::size_t i = 0; i < edges.whole.size(); ++i) {
    lengths_m[edge_of(i)] += EdgeLength(edges.whole[i]);
  }
  std::vector<PlySegment> pieces;
  for (std::size_t i = 0; i < edges.whole.size(); ++i) {
    if (lengths_m[edge_of(i)] >= min_length_m) pieces.push_back(edges.whole[i]);
  }
  return pieces;
}

// How many frames show each place of a piece of an edge.
struct WatchedEdge {
  PlySegment piece;
  std::vector<int> frames;

  Eigen::Vector3d At(double sample) const {
    return piece.start_world +
           sample / static_cast<double>(frames.size()) * (piece.end_world - piece.start_world);
  }
};

double Distance_m(const PlySegment& segment, const Eigen::Vector3d& p) {
  const Eigen::Vector3d along = segment.end_world - segment.start_world;
  const double share =
      std::clamp(along.dot(p - segment.start_world) / along.squaredNorm(), 0.0, 1.0);
  return (segment.start_world + share * along - p).norm();
}

// A camera at a place, and what hides things from it.
struct Watcher {
  const Camera& camera;
  const TriangleTree& surfaces;
  const ClearSightOptions& options;

  bool Sees(const RigidTransform& T_world_camera, const Eigen::Vector3d& p_world) const {
    const Eigen::Vector3d to_place = p_world - T_world_camera.translation;
    const double distance_m = to_place.norm();
    if (distance_m > options.max_range_m || distance_m <= options.margin_m) return false;
    const auto px = camera.Project(T_world_camera.rotation.conjugate() * to_place);
    if (!px || !camera.Contains(*px)) return false;
    const double free_m = distance_m - options.margin_m;
    return !std::isfinite(
        surfaces.FirstHit_m(T_world_camera.translation, to_place / distance_m, free_m));
  }

  void Watch(const RigidTransform& T_world_camera, WatchedEdge* edge) const {
    if (Distance_m(edge->piece, T_world_camera.translation) > options.max_range_m) return;
    for (std::size_t i = 0; i < edge->frames.size(); ++i) {
      int& frames = edge->frames[i];
      if (frames >= options.min_frames) continue;
      frames += Sees(T_world_camera, edge->At(static_cast<double>(i) + 0.5));
    }
  }
};

void AddParts(const WatchedEdge& edge, int min_frames, std::vector<PlySegment>* parts) {
  const std::size_t count = edge.frames.size();
  for (std::size_t i = 0; i < count; ++i) {
    if (edge.frames[i] < min_frames) continue;
    const std::size_t first = i;
    while (i < count && edge.frames[i] >= min_frames) ++i;
    parts->push_back({edge.At(static_cast<double>(first)), edge.At(static_cast<double>(i))});
  }
}

}  // namespace

void ClearSightOptions::Check() const { kEdgesTable.Check("clear sight", *this); }

std::vector<PlySegment> ClearlySeen(const TrueEdges& edges, const TriangleTree& surfaces,
                                    const Trajectory& truth, const Rig& rig,
                                    const ClearSightOptions& options, const Progress& progress) {
  options.Check();
  std::vector<WatchedEdge> watched;
  for (const PlySegment& piece : LongEdges(edges, options.min_length_m)) {
    const double samples = std::max(std::round(EdgeLength(piece) / options.sample_m), 1.0);
    watched.push_back({piece, std::vector<int>(static_cast<std::size_t>(samples), 0)});
  }
  const Watcher watcher{rig.cameras[0], surfaces, options};
  const Trajectory frames = PosesApart(truth, options.interval_s);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(frames.size()));
    const RigidTransform T_world_camera = frames[i].T_world_imu * rig.T_imu_camera[0];
    for (WatchedEdge& edge : watched) watcher.Watch(T_world_camera, &edge);
  }
  std::vector<PlySegment> parts;
  for (const WatchedEdge& edge : watched) AddParts(edge, options.min_frames, &parts);
  return parts;
}

}  // namespace slcmap
