#include "export/scene/scene.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "data/core/error.h"
#include "data/core/math.h"
#include "export/scene/meshes.h"

namespace slcmap::inline exporting {
namespace {

constexpr Colour kKeyframeColour{250, 140, 20};

// Maps heights to colours so that the lowest and highest two percent do not use up the scale.
class HeightColours {
 public:
  explicit HeightColours(std::vector<double> heights_m) {
    if (heights_m.empty()) return;
    std::sort(heights_m.begin(), heights_m.end());
    const std::size_t margin = heights_m.size() / 50;
    low_m_ = heights_m[margin];
    range_m_ = std::max(heights_m[heights_m.size() - 1 - margin] - low_m_, kMinRange_m);
  }
  Colour At(double height_m) const { return ScaleColour((height_m - low_m_) / range_m_); }

 private:
  static constexpr double kMinRange_m = 0.1;
  double low_m_ = 0, range_m_ = 1;
};

Vertices MakePoints(const MapResult& map, const HeightColours& colours) {
  Vertices points;
  for (const MapPoint& point : map.points) {
    points.Add(point.p_world, colours.At(point.p_world.z()));
  }
  return points;
}

void AddEdge(const Eigen::Vector3d& start, const Eigen::Vector3d& end, const Colour& colour,
             LineLayer* layer) {
  const auto first = static_cast<uint32_t>(layer->vertices.size());
  layer->vertices.Add(start, colour);
  layer->vertices.Add(end, colour);
  layer->edges.push_back({first, first + 1});
}

LineLayer MakeLineLayer(const MapResult& map) {
  LineLayer layer;
  for (const MapLine& line : map.lines) {
    const auto [red, green, blue] = LineColour(line.axis, line.recent);
    AddEdge(line.start_world, line.end_world, {red, green, blue}, &layer);
  }
  return layer;
}

LineLayer MakeTrajectoryLayer(const MapResult& map) {
  LineLayer layer;
  const Trajectory& poses = map.trajectory;
  const double gap_s = TrajectoryGap_s(poses);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto vertex = static_cast<uint32_t>(i);
    layer.vertices.Add(poses[i].T_world_imu.translation,
                       ScaleColour(static_cast<double>(i) / static_cast<double>(poses.size())));
    if (i == 0 || ToSeconds(poses[i].stamp_ns - poses[i - 1].stamp_ns) > gap_s) continue;
    layer.edges.push_back({vertex - 1, vertex});
  }
  return layer;
}

LineLayer MakeKeyframeLayer(const MapResult& map) {
  constexpr double kSpacing_m = 0.5;  // keyframes nearer to the last drawn one are left out
  LineLayer layer;
  const std::vector<Eigen::Vector3d> corners =
      FrustumCorners(map.rectified_rig.cameras[0], 0.2);  // m long
  Eigen::Vector3d last = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  for (const StampedPose& keyframe : map.keyframes) {
    const RigidTransform T_world_camera = keyframe.T_world_imu * map.rectified_rig.T_imu_camera[0];
    if ((T_world_camera.translation - last).norm() < kSpacing_m) continue;
    last = T_world_camera.translation;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Eigen::Vector3d corner = T_world_camera * corners[i];
      AddEdge(T_world_camera.translation, corner, kKeyframeColour, &layer);
      AddEdge(corner, T_world_camera * corners[(i + 1) % corners.size()], kKeyframeColour, &layer);
    }
  }
  return layer;
}

constexpr int64_t kBarVertices = 8, kFrustumVertices = 16, kCubeVertices = 24;

// Before a vertex is made: each takes memory several times over, until it is written.
void CheckSize(const MapResult& map, const std::vector<Voxel>& voxels, int max_vertices) {
  if (max_vertices <= 0) {
    throw ConfigError(fmt::format("max_vertices: found {}, expected more than 0", max_vertices));
  }
  const int64_t others = std::ssize(map.points) + std::ssize(map.trajectory) +
                         kFrustumVertices * std::ssize(map.keyframes) +
                         (2 + kBarVertices) * std::ssize(map.lines);
  int64_t of_voxels = kCubeVertices * std::ssize(voxels);  // at most
  if (others + of_voxels > max_vertices) of_voxels = CountVoxelVertices(voxels);
  if (others + of_voxels <= max_vertices) return;
  throw ConfigError(fmt::format(
      "max_vertices: found a map of {} vertices, {} of them for its {} occupied voxels, expected "
      "at most {}: map with a coarser mapping.occupancy.resolution_m, or give a higher limit",
      others + of_voxels, of_voxels, voxels.size(), max_vertices));
}

}  // namespace

int64_t MapScene::CountVertices() const {
  return std::ssize(points.positions) + std::ssize(lines.vertices.positions) +
         std::ssize(trajectory.vertices.positions) + std::ssize(keyframes.vertices.positions) +
         std::ssize(voxels.vertices.positions) + std::ssize(line_bars.vertices.positions);
}

MapScene MakeScene(const MapResult& map, int max_vertices, const Progress& progress) {
  constexpr double kBar_m = 0.04;  // width of lines that are drawn as bars
  const std::vector<Voxel> voxels = map.occupancy.OccupiedVoxels();
  CheckSize(map, voxels, max_vertices);
  progress.ReportOrStop(0);
  std::vector<double> heights_m;
  for (const MapPoint& point : map.points) heights_m.push_back(point.p_world.z());
  const HeightColours colours(std::move(heights_m));
  MapScene scene{MakePoints(map, colours),
                 MakeLineLayer(map),
                 MakeTrajectoryLayer(map),
                 MakeKeyframeLayer(map),
                 {},
                 {}};
  AddVoxels(
      voxels, [&](const Voxel& voxel) { return colours.At(voxel.centre_world.z()); }, &scene.voxels,
      progress);
  AddBars(scene.lines, kBar_m, &scene.line_bars);
  return scene;
}

namespace {

// At equal steps. All are bright, so that they show on dark pages, and in viewers that take glTF's
// linear colours for those of the screen.
constexpr std::array<std::array<double, 3>, 5> kScale = {
    {{80, 130, 255}, {50, 200, 230}, {90, 225, 110}, {250, 220, 70}, {255, 120, 60}}};

uint8_t ToByte(double value) { return static_cast<uint8_t>(std::lround(value)); }

}  // namespace

Colour ScaleColour(double u) {
  const double place = std::clamp(u, 0.0, 1.0) * (kScale.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(place), kScale.size() - 2);
  const double fraction = place - static_cast<double>(below);
  const auto part = [&](std::size_t i) {
    return ToByte((1 - fraction) * kScale[below][i] + fraction * kScale[below + 1][i]);
  };
  return {part(0), part(1), part(2)};
}

Colour Shade(const Colour& colour, double factor) {
  return {ToByte(factor * colour.red), ToByte(factor * colour.green), ToByte(factor * colour.blue)};
}

std::vector<Eigen::Vector3d> FrustumCorners(const Camera& camera, double depth_m) {
  if (!(camera.fx_px > 0 && camera.fy_px > 0)) return {};
  const double right_px = camera.width_px - 0.5, bottom_px = camera.height_px - 0.5;
  std::vector<Eigen::Vector3d> corners;
  for (const Eigen::Vector2d& pixel_px :
       {Eigen::Vector2d(-0.5, -0.5), Eigen::Vector2d(right_px, -0.5),
        Eigen::Vector2d(right_px, bottom_px), Eigen::Vector2d(-0.5, bottom_px)}) {
    const std::optional<Eigen::Vector3d> ray = camera.Unproject(pixel_px);
    if (!ray || !(ray->z() > 0)) return {};
    corners.push_back(*ray * (depth_m / ray->z()));
  }
  return corners;
}

double TrajectoryGap_s(const Trajectory& trajectory) {
  constexpr double kLeast_s = 0.5, kMedianSteps = 4;
  std::vector<double> steps_s;
  for (size_t i = 1; i < trajectory.size(); ++i) {
    steps_s.push_back(ToSeconds(trajectory[i].stamp_ns - trajectory[i - 1].stamp_ns));
  }
  return std::max(kLeast_s, kMedianSteps * Quantile(std::move(steps_s), 0.5));
}

const MapScene& SceneOfMap::Get(const MapResult& map, const Progress& progress) {
  if (!scene_) scene_ = MakeScene(map, max_vertices_, progress);
  return *scene_;
}

}  // namespace slcmap::exporting
