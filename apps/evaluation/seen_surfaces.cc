#include "apps/evaluation/seen_surfaces.h"

#include <cmath>
#include <map>

#include "data/option_table.h"

namespace slcmap {
namespace {

constexpr OptionTable kVisibilityTable{
    Option{"interval_s", &VisibilityOptions::interval_s, 1e-3, 1e3},
    Option{"stride_px", &VisibilityOptions::stride_px, 1, 1000},
    Option{"max_range_m", &VisibilityOptions::max_range_m, 0.1, 1e3},
    Option{"cell_m", &VisibilityOptions::cell_m, 1e-3, 10.0}};

std::vector<Eigen::Vector3d> RaysOf(const Camera& camera, int stride_px) {
  std::vector<Eigen::Vector3d> rays;
  for (int v = stride_px / 2; v < camera.height_px; v += stride_px) {
    for (int u = stride_px / 2; u < camera.width_px; u += stride_px) {
      if (const auto ray = camera.Unproject(Eigen::Vector2d(u, v))) rays.push_back(*ray);
    }
  }
  return rays;
}

}  // namespace

void VisibilityOptions::Check() const { kVisibilityTable.Check("visibility", *this); }

Trajectory PosesApart(const Trajectory& poses, double interval_s) {
  const int64_t step_ns = ToNanoseconds(interval_s);
  Trajectory apart;
  for (const StampedPose& pose : poses) {
    if (apart.empty() || pose.stamp_ns >= apart.back().stamp_ns + step_ns) apart.push_back(pose);
  }
  return apart;
}

std::vector<ReferenceView> ReferenceViews(const TriangleTree& surfaces, const Trajectory& truth,
                                          const Rig& rig, const VisibilityOptions& options,
                                          const Progress& progress) {
  const std::vector<Eigen::Vector3d> rays = RaysOf(rig.cameras[0], options.stride_px);
  const Trajectory poses = PosesApart(truth, options.interval_s);
  std::vector<ReferenceView> views;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(poses.size()));
    const RigidTransform T_world_camera = poses[i].T_world_imu * rig.T_imu_camera[0];
    ReferenceView view{T_world_camera.translation, {}};
    for (const Eigen::Vector3d& ray : rays) {
      const Eigen::Vector3d direction = T_world_camera.rotation * ray;
      const double range_m = surfaces.FirstHit_m(view.p_camera, direction, options.max_range_m);
      if (std::isfinite(range_m)) view.ends.emplace_back(view.p_camera + range_m * direction);
    }
    views.push_back(std::move(view));
  }
  return views;
}

std::vector<SeenSample> SeenSurfaces(const std::vector<ReferenceView>& views, double cell_m) {
  std::map<std::array<int64_t, 3>, SeenSample> cells;
  for (const ReferenceView& view : views) {
    for (const Eigen::Vector3d& end : view.ends) {
      const Eigen::Vector3d scaled = end / cell_m;
      const std::array<int64_t, 3> cell = {std::llround(scaled.x()), std::llround(scaled.y()),
                                           std::llround(scaled.z())};
      const double range_m = (end - view.p_camera).norm();
      const auto [entry, is_new] = cells.try_emplace(cell, SeenSample{end, range_m});
      if (!is_new && range_m < entry->second.range_m) entry->second = {end, range_m};
    }
  }
  std::vector<SeenSample> samples;
  for (const auto& [cell, sample] : cells) samples.push_back(sample);
  return samples;
}

}  // namespace slcmap
