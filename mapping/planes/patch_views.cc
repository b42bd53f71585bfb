#include "mapping/planes/patch_views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "odometry/geometry/pinhole.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMinDepth_m = 0.3;
constexpr double kMargin_px = 4;

struct Candidate {
  PatchImage image;
  Vector3d ray = Vector3d::Zero();  // from the patch, of length 1
  double pixels_per_m = 0;          // in the direction in which the patch is seen smallest
};

bool ShowsAll(const PlanePatch& patch, const PatchImage& image, const ViewCameras& cameras,
              const SightDepths& sights) {
  const double half_m = 0.5 * patch.side_m;
  const std::array<Vector2d, 5> places = {Vector2d(0, 0), Vector2d(-half_m, -half_m),
                                          Vector2d(half_m, -half_m), Vector2d(-half_m, half_m),
                                          Vector2d(half_m, half_m)};
  return std::all_of(places.begin(), places.end(), [&](const Vector2d& place) {
    const Vector3d p = cameras.T_camera_world[image.view][image.camera] *
                       (patch.middle_world + place.x() * patch.u + place.y() * patch.v);
    if (p.z() < kMinDepth_m) return false;
    const Camera& camera = cameras.cameras[image.camera];
    const Vector2d px = PixelFromPlane(camera, Vector2d(p.hnormalized()));
    return camera.Contains(px, kMargin_px) && !sights.Hides(image.view, image.camera, px, p.z());
  });
}

// The images that show a patch, the one that shows it largest first.
std::vector<Candidate> Candidates(const PlanePatch& patch, const Views& views,
                                  const ViewCameras& cameras, const SightDepths& sights,
                                  const PlaneOptions& options) {
  const double min_cosine = std::cos(options.max_grazing_deg * M_PI / 180);
  std::vector<Candidate> candidates;
  for (int view = 0; view < static_cast<int>(views.size()); ++view) {
    for (const int camera : {0, 1}) {
      const Vector3d way = cameras.Centre(view, camera) - patch.middle_world;
      const double range_m = way.norm(), cosine = patch.normal.dot(way) / range_m;
      if (range_m > options.max_range_m || cosine < min_cosine) continue;
      if (!ShowsAll(patch, {view, camera}, cameras, sights)) continue;
      candidates.push_back(
          {{view, camera}, way / range_m, cameras.cameras[camera].fx_px * cosine / range_m});
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.pixels_per_m > b.pixels_per_m; });
  return candidates;
}

}  // namespace

std::vector<PatchImage> ImagesOfPatch(const PlanePatch& patch, const Views& views,
                                      const ViewCameras& cameras, const SightDepths& sights,
                                      const PlaneOptions& options) {
  const double max_cosine = std::cos(options.min_parallax_deg * M_PI / 180);
  std::vector<Candidate> chosen;
  for (const Candidate& candidate : Candidates(patch, views, cameras, sights, options)) {
    if (static_cast<int>(chosen.size()) == options.max_images) break;
    const bool is_apart = std::all_of(chosen.begin(), chosen.end(), [&](const Candidate& other) {
      return other.ray.dot(candidate.ray) <= max_cosine;
    });
    const bool is_near =
        chosen.empty() ||
        (views[chosen.front().image.view].segment == views[candidate.image.view].segment &&
         std::abs(chosen.front().image.view - candidate.image.view) <= options.window_views);
    if (is_apart && is_near) chosen.push_back(candidate);
  }
  std::vector<PatchImage> images;
  for (const Candidate& candidate : chosen) images.push_back(candidate.image);
  return images;
}

}  // namespace slcmap
