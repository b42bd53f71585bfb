#include "data/simulator/pipe_truth.h"

#include <cmath>
#include <cstdint>

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr double kPipeRange_m = 8;
constexpr double kPipeMargin_m = 0.01;   // a surface this near in front of a point does not hide it
constexpr double kPipeInterval_s = 0.5;  // between frames that are looked at
constexpr double kSample_m = 0.05;       // along an axis

// The places along the axis of a pipe that cameras see.
class PipeWatch {
 public:
  PipeWatch(const ScenePipe& pipe, const RayScene& rays) : pipe_(pipe), rays_(rays) {
    const double length_m = (pipe.b - pipe.a).norm();
    seen_.assign(static_cast<size_t>(std::ceil(length_m / kSample_m)), 0);
  }

  void Look(const Camera& camera, const RigidTransform& T_world_camera) {
    const RigidTransform T_camera_world = T_world_camera.Inverse();
    for (size_t i = 0; i < seen_.size(); ++i) {
      const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(seen_.size());
      if (seen_[i]) continue;
      const Vector3d p = Facing(pipe_.a + share * (pipe_.b - pipe_.a), T_world_camera.translation);
      seen_[i] = Sees(camera, T_camera_world * p, T_world_camera);
    }
  }

  std::vector<SeenStretch> Stretches() const {
    const double step_m = (pipe_.b - pipe_.a).norm() / static_cast<double>(seen_.size());
    std::vector<SeenStretch> stretches;
    for (size_t i = 0; i < seen_.size(); ++i) {
      if (!seen_[i]) continue;
      const size_t first = i;
      while (i < seen_.size() && seen_[i]) ++i;
      stretches.push_back({step_m * static_cast<double>(first), step_m * static_cast<double>(i)});
    }
    return stretches;
  }

 private:
  // The point of the surface before a point of the axis.
  Vector3d Facing(const Vector3d& on_axis, const Vector3d& centre) const {
    const Vector3d along = (pipe_.b - pipe_.a).normalized();
    const Vector3d way = centre - on_axis;
    return on_axis + (pipe_.radius_m + kPipeMargin_m) * (way - along.dot(way) * along).normalized();
  }

  bool Sees(const Camera& camera, const Vector3d& p_camera,
            const RigidTransform& T_world_camera) const {
    const double distance_m = p_camera.norm();
    if (distance_m > kPipeRange_m || distance_m <= kPipeMargin_m) return false;
    const auto pixel = camera.Project(p_camera);
    if (!pixel || !camera.Contains(*pixel)) return false;
    const Vector3d ray = T_world_camera.rotation * (p_camera / distance_m);
    return !rays_.Blocked(T_world_camera.translation.cast<float>(), ray.cast<float>(),
                          static_cast<float>(distance_m - kPipeMargin_m));
  }

  const ScenePipe& pipe_;
  const RayScene& rays_;
  std::vector<uint8_t> seen_;
};

void Look(const RenderTask& task, double t_s, std::vector<PipeWatch>* watches) {
  for (int c = 0; c < 2; ++c) {
    const RigidTransform T_world_camera = task.motion.PoseAt(t_s) * task.rig.T_imu_camera[c];
    for (PipeWatch& watch : *watches) watch.Look(task.rig.cameras[c], T_world_camera);
  }
}

}  // namespace

std::vector<TruePipe> ObservePipes(const Scene& scene, const RayScene& rays, const RenderTask& task,
                                   int frames) {
  std::vector<PipeWatch> watches;
  for (const ScenePipe& pipe : scene.pipes) watches.emplace_back(pipe, rays);
  double next_s = 0;
  for (int frame = 0; frame < frames && !task.stop.stop_requested(); ++frame) {
    if (task.times_s[frame] < next_s) continue;
    next_s = task.times_s[frame] + kPipeInterval_s;
    Look(task, task.times_s[frame], &watches);
  }
  std::vector<TruePipe> pipes;
  for (size_t i = 0; i < watches.size(); ++i) {
    const ScenePipe& pipe = scene.pipes[i];
    pipes.push_back(
        {static_cast<int64_t>(i), pipe.a, pipe.b, pipe.radius_m, watches[i].Stretches()});
  }
  return pipes;
}

}  // namespace slcmap
