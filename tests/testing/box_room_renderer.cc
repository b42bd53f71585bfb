#include "tests/testing/box_room_renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace slcmap {
namespace {

// A random number in [0, 1) for a point of a lattice.
double Hash(int64_t x, int64_t y, int64_t z) {
  uint64_t h = static_cast<uint64_t>(x) * 0x9E3779B97F4A7C15u ^
               static_cast<uint64_t>(y) * 0xC2B2AE3D27D4EB4Fu ^
               static_cast<uint64_t>(z) * 0x165667B19E3779F9u;
  h = (h ^ (h >> 29)) * 0xBF58476D1CE4E5B9u;
  h = (h ^ (h >> 32)) * 0x94D049BB133111EBu;
  return static_cast<double>((h ^ (h >> 31)) >> 11) * 0x1p-53;
}

// Value noise in space, smooth over one cell.
double ValueNoise(const Eigen::Vector3d& p) {
  const Eigen::Vector3d cell = p.array().floor();
  Eigen::Vector3d u = p - cell;
  u = u.array() * u.array() * (3 - 2 * u.array());
  const auto x = static_cast<int64_t>(cell.x()), y = static_cast<int64_t>(cell.y()),
             z = static_cast<int64_t>(cell.z());
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int dx = corner & 1, dy = corner >> 1 & 1, dz = corner >> 2;
    sum += (dx ? u.x() : 1 - u.x()) * (dy ? u.y() : 1 - u.y()) * (dz ? u.z() : 1 - u.z()) *
           Hash(x + dx, y + dy, z + dz);
  }
  return sum;
}

}  // namespace

BoxRoomRenderer::BoxRoomRenderer(const RenderTask& task, double wall_distance_m, double panel_m)
    : task_(task), panel_m_(panel_m) {
  for (double t_s = 0; t_s <= task.motion.Duration(); t_s += 0.05) {
    room_.extend(task.motion.PoseAt(t_s).translation);
  }
  room_.min().array() -= wall_distance_m;
  room_.max().array() += wall_distance_m;
  for (const Camera& camera : task.rig.cameras) {
    std::vector<Eigen::Vector3f>& rays = rays_camera_.emplace_back();
    for (int y = 0; y < camera.height_px; ++y) {
      for (int x = 0; x < camera.width_px; ++x) {
        const auto ray = camera.Unproject({x, y});
        rays.push_back(ray.value_or(Eigen::Vector3d::Zero()).cast<float>());
      }
    }
  }
}

RenderedPair BoxRoomRenderer::Render(int frame, bool with_depth) {
  RenderedPair pair;
  Paint(0, frame, &pair.left, with_depth ? &pair.depth_m : nullptr);
  Paint(1, frame, &pair.right, nullptr);
  for (int camera = 2; camera < CameraCount(task_.rig); ++camera) {
    Paint(camera, frame, &pair.others.emplace_back(), nullptr);
  }
  return pair;
}

// Of a wall point; details finer than two pixels fade out.
uchar BoxRoomRenderer::Grey(const Eigen::Vector3d& p_world, double pixel_m) const {
  double value = 0.5;
  for (const double cell_m : {0.8, 0.3, 0.12, 0.05, 0.02}) {
    const double visible = std::clamp(cell_m / pixel_m / 2 - 1, 0.0, 1.0);
    if (visible > 0) value += 0.45 * visible * (ValueNoise(p_world / cell_m) - 0.5);
  }
  if (panel_m_ > 0) {
    const Eigen::Array3d panel = (p_world.array() / panel_m_).floor();
    if (std::lround(panel.sum()) % 2 != 0) value *= 0.4;
  }
  return static_cast<uchar>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
}

void BoxRoomRenderer::Paint(int camera, int frame, cv::Mat* image, cv::Mat* depth_m) const {
  const Camera& model = task_.rig.cameras[camera];
  const RigidTransform T_world_camera =
      task_.motion.PoseAt(task_.times_s[frame]) * task_.rig.T_imu_camera[camera];
  const Eigen::Matrix3d R_world_camera = T_world_camera.rotation.toRotationMatrix();
  image->create(model.height_px, model.width_px, CV_8U);
  if (depth_m != nullptr) depth_m->create(model.height_px, model.width_px, CV_32F);
  for (int i = 0; i < model.height_px * model.width_px; ++i) {
    const Eigen::Vector3d ray_camera = rays_camera_[camera][i].cast<double>();
    const Eigen::Vector3d ray = R_world_camera * ray_camera;
    double distance_m = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
      if (ray[k] == 0) continue;
      const double wall = ray[k] > 0 ? room_.max()[k] : room_.min()[k];
      distance_m = std::min(distance_m, (wall - T_world_camera.translation[k]) / ray[k]);
    }
    const bool seen = std::isfinite(distance_m);
    image->data[i] =
        seen ? Grey(T_world_camera.translation + distance_m * ray, distance_m / model.fx_px) : 0;
    if (depth_m != nullptr) {
      depth_m->ptr<float>()[i] = seen ? static_cast<float>(distance_m * ray_camera.z()) : 0;
    }
  }
}

void BoxRoomRenderer::WriteTruth(const std::string&, int) {}

}  // namespace slcmap
