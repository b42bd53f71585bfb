// The views that look at a patch of a plane.
#pragma once

#include <vector>

#include "mapping/lines/sight_depths.h"
#include "mapping/lines/view_cameras.h"
#include "mapping/planes/plane_grid.h"
#include "mapping/planes/plane_options.h"

namespace slcmap {

// A square of a plane.
struct PlanePatch {
  Eigen::Vector3d middle_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ(), u = Eigen::Vector3d::UnitX(),
                  v = Eigen::Vector3d::UnitY();
  double side_m = 0;
};

struct PatchImage {
  int view = 0, camera = 0;
};

// The images that show all of a patch, near enough and not too slantingly, with no measured surface
// clearly before it: at most max_images, the one that shows it largest first, and then those around
// it in time, seen from the patch min_parallax_deg apart.
std::vector<PatchImage> ImagesOfPatch(const PlanePatch& patch, const Views& views,
                                      const ViewCameras& cameras, const SightDepths& sights,
                                      const PlaneOptions& options);

}  // namespace slcmap
