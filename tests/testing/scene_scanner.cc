#include "tests/testing/scene_scanner.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>

#include "data/simulator/ray_scene.h"
#include "data/simulator/scene/scene_builder.h"
#include "data/simulator/truth.h"
#include "tests/testing/temp_folder.h"

namespace slcmap::testing {
namespace {

using Eigen::Vector3d;

double Normal(std::mt19937* generator) {
  // Box and Muller's: the same on each machine.
  const double radius = std::sqrt(-2 * std::log(UniformIn(1e-12, 1, generator)));
  return radius * std::cos(UniformIn(0, 2 * M_PI, generator));
}

// Evenly over the sphere, turned about the vertical.
Vector3d ComputeRay(int i, int count, double turn_rad) {
  constexpr double kGoldenAngle = 2.399963229728653;
  const double z = 1 - (2 * i + 1.0) / count, level = std::sqrt(1 - z * z);
  const double angle = kGoldenAngle * i + turn_rad;
  return {level * std::cos(angle), level * std::sin(angle), z};
}

using VoxelKey = std::array<int, 4>;

struct Voxel {
  Vector3d p = Vector3d::Zero(), normal = Vector3d::Zero();  // sums, by weight
  double weight = 0;
};

VoxelKey MakeKey(const Vector3d& p, const Vector3d& normal, double voxel_m) {
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  const int way = 2 * axis + (normal[axis] > 0 ? 1 : 0);
  const Eigen::Array3d cell = (p.array() / voxel_m).floor();
  return {static_cast<int>(cell.x()), static_cast<int>(cell.y()), static_cast<int>(cell.z()), way};
}

bool Sees(const RayScene& rays, const ScanOptions& options, const Vector3d& place,
          const Vector3d& p) {
  constexpr double kMargin_m = 0.02;
  const Vector3d way = p - place;
  const double distance_m = way.norm();
  return distance_m < options.range_m && distance_m > kMargin_m &&
         !rays.Blocked(place.cast<float>(), (way / distance_m).cast<float>(),
                       static_cast<float>(distance_m - kMargin_m));
}

class Scanner {
 public:
  Scanner(const Scene& scene, const ScanOptions& options)
      : scene_(scene), options_(options), patches_(SeenPatches(scene)), rays_(patches_) {}

  BuildingInput Scan(const std::vector<Vector3d>& places) {
    BuildingInput input;
    input.trajectory_world = places;
    for (size_t i = 0; i < places.size(); ++i) {
      const Vector3d drift = 2 * i >= places.size() ? options_.drift_m : Vector3d::Zero();
      input.rays.push_back(Look(places[i], drift));
    }
    for (const auto& [key, voxel] : voxels_) {
      input.points.push_back({voxel.p / voxel.weight, voxel.normal.normalized(),
                              std::max(0.004, 1 / std::sqrt(voxel.weight))});
    }
    if (options_.with_lines) AddLines(places, &input);
    return input;
  }

 private:
  bool IsTextured(const ScenePatch& patch) const {
    const SurfaceMaterial& material = scene_.materials[scene_.quads[patch.quad].material];
    return material.contrast > 0 && material.texture != TextureKind::kLamp;
  }

  ViewRays Look(const Vector3d& place, const Vector3d& drift) {
    ViewRays rays{place + drift, {}, {}};
    const double turn_rad = UniformIn(0, 2 * M_PI, &generator_);
    RayScene::Packet packet;
    for (int first = 0; first < options_.rays; first += RayScene::kLanes) {
      packet.Clear();
      for (int lane = 0; lane < RayScene::kLanes; ++lane) {
        const Vector3d ray = ComputeRay(first + lane, options_.rays + RayScene::kLanes, turn_rad);
        packet.Set(lane, place.cast<float>(), ray.cast<float>(),
                   static_cast<float>(options_.range_m));
      }
      rays_.Trace(&packet);
      for (int lane = 0; lane < RayScene::kLanes; ++lane) {
        if (packet.active[lane] == 0 || packet.rays.hit.geomID[lane] == RayScene::kNoQuad) continue;
        const Vector3d ray = ComputeRay(first + lane, options_.rays + RayScene::kLanes, turn_rad);
        AddHit(patches_[packet.rays.hit.primID[lane]], place, ray, packet.rays.ray.tfar[lane],
               drift, &rays);
      }
    }
    return rays;
  }

  void AddHit(const ScenePatch& patch, const Vector3d& place, const Vector3d& ray,
              double distance_m, const Vector3d& drift, ViewRays* rays) {
    if (!IsTextured(patch)) return;
    const double sigma_m = options_.noise_m;
    const Vector3d p = place + (distance_m + sigma_m * Normal(&generator_)) * ray + drift;
    rays->p_world.push_back(p.cast<float>());
    rays->sigma_m.push_back(static_cast<float>(sigma_m));
    Vector3d normal = patch.normal.cast<double>();
    if (normal.dot(ray) > 0) normal = -normal;
    for (int k = 0; k < 3; ++k) normal[k] += options_.normal_noise_rad * Normal(&generator_);
    Voxel& voxel = voxels_[MakeKey(p, normal, options_.voxel_m)];
    const double weight = 1 / (sigma_m * sigma_m);
    voxel.p += weight * p;
    voxel.normal += weight * normal.normalized();
    voxel.weight += weight;
  }

  void AddLines(const std::vector<Vector3d>& places, BuildingInput* input) {
    constexpr double kStep_m = 0.2, kShortest_m = 0.3;
    for (const TrueEdge& edge : scene_.edges) {
      const double length_m = (edge.b - edge.a).norm();
      const Vector3d direction = (edge.b - edge.a) / length_m;
      double from_m = length_m, to_m = 0;
      for (double at_m = 0; at_m <= length_m; at_m += kStep_m) {
        const bool seen = std::any_of(places.begin(), places.end(), [&](const Vector3d& place) {
          return Sees(rays_, options_, place, edge.a + at_m * direction);
        });
        if (!seen) continue;
        from_m = std::min(from_m, at_m);
        to_m = std::max(to_m, std::min(at_m + kStep_m, length_m));
      }
      if (to_m - from_m < kShortest_m) continue;
      Vector3d noise;
      for (int k = 0; k < 3; ++k) noise[k] = options_.line_noise_m * Normal(&generator_);
      MapLine line;
      line.id = static_cast<int64_t>(input->lines.size());
      line.sigma_m = options_.line_noise_m;
      line.start_world = edge.a + from_m * direction + noise;
      line.end_world = edge.a + to_m * direction + noise;
      input->lines.push_back(line);
    }
  }

  const Scene& scene_;
  const ScanOptions options_;
  const std::vector<ScenePatch> patches_;
  const RayScene rays_;
  std::mt19937 generator_{1};
  std::map<VoxelKey, Voxel> voxels_;
};

}  // namespace

BuildingInput Scan(const Scene& scene, const std::vector<Vector3d>& places,
                   const ScanOptions& options) {
  return Scanner(scene, options).Scan(places);
}

TrueBuilding SeenFrom(const Scene& scene, const std::vector<Vector3d>& places,
                      const ScanOptions& options) {
  const RayScene rays(SeenPatches(scene));
  const auto is_seen = [&](const Vector3d& p) {
    return std::ranges::any_of(
        places, [&](const Vector3d& place) { return Sees(rays, options, place, p); });
  };
  return ObserveBuilding(scene, is_seen, places);
}

std::vector<Vector3d> PlacesAlong(const std::vector<Vector3d>& waypoints, double step_m) {
  std::vector<Vector3d> places = {waypoints.front()};
  for (size_t i = 1; i < waypoints.size(); ++i) {
    const Vector3d way = waypoints[i] - waypoints[i - 1];
    const int steps = std::max(1, static_cast<int>(std::ceil(way.norm() / step_m)));
    for (int k = 1; k <= steps; ++k) places.push_back(waypoints[i - 1] + way * k / steps);
  }
  return places;
}

Scene SceneFromText(const std::string& yaml) {
  const TempFolder folder;
  return ReadScene(folder.Write("scene.yaml", yaml));
}

Scene RoomWithBoxes(const std::string& size, const std::string& corners) {
  return SceneFromText("objects:\n  - {kind: slab, at: [0, 0, 0], size: " + size +
                       ", material: carpet}\n  - {kind: wall, points: " + corners +
                       R"(, closed: true}
  - {kind: box, at: [0.5, 3.2, 0], size: [0.8, 0.6, 1.8]}
  - {kind: box, at: [3.2, 0.4, 0], size: [1.2, 0.6, 0.75]}
)");
}

}  // namespace slcmap::testing
