// What images say of where a patch is along its normal.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "mapping/dense/depth_refinement.h"
#include "mapping/planes/patch_views.h"

namespace slcmap {

struct SeenPatch {
  const DepthPyramid* image = nullptr;
  RigidTransform T_camera_world;
};

// By place along the normal, from -sweep_m to sweep_m in steps.
struct PatchSweep {
  std::vector<double> misfit;       // minus log-likelihood, 0 at the best place; empty: not seen
  std::vector<double> correlation;  // mean over all pairs of images; of noise about 0
  double grey = 0;
  double saturated = 0;  // share of what the images show on the plane, as of lamps and panes
};

// Compares what the images show of a patch when it is moved along its normal. What changes slowly
// over the patch, as light does, counts for nothing.
PatchSweep SweepPatch(const PlanePatch& patch, const std::vector<SeenPatch>& images,
                      const Camera& camera, const PlaneOptions& options);

// The best place of a sweep, or of the sum of several.
struct SweptPlace {
  double offset_m = 0, sigma_m = 0;
  double margin = 0;  // log-likelihood over the best of those clearly elsewhere
};
SweptPlace BestPlace(const std::vector<double>& misfit, const PlaneOptions& options);

}  // namespace slcmap
