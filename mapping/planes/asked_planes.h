// Suggested planes, cut into patches that images are asked about.
#pragma once

#include <vector>

#include "mapping/building/building_input.h"
#include "mapping/planes/patch_views.h"
#include "mapping/planes/plane_suggestions.h"
#include "mapping/planes/plane_sweep.h"
#include "mapping/planes/point_index.h"

namespace slcmap {

struct AskedPatch {
  int column = 0, row = 0;  // among the patches of its plane
  PlanePatch patch;
  std::vector<PatchImage> images;
  PatchSweep sweep;
  bool agrees = false;
};

struct AskedPlane {
  SuggestedPlane suggested;
  cv::Mat1b open;   // by cell: not 0 where it may be filled
  cv::Mat1b solid;  // by cell: not 0 where no ray goes through
  std::vector<AskedPatch> patches;
};

// Cells along the side of a patch.
int CellsOfPatch(const PlaneOptions& options);

// The plane with those patches that have enough cells to be filled: near to what suggests the
// plane, where nothing was measured and no ray goes through.
AskedPlane AskPlane(SuggestedPlane suggested, const PointIndex& measured,
                    const std::vector<Sights>& sights, const PlaneOptions& options);

// Decides which patches of a plane the images agree with: what a patch and those beside it say
// together has its best place at the plane, its own images do not clearly say otherwise, and they
// are alike there. Where few of a plane's patches agree, none does: the plane is none.
void JudgePatches(const PlaneOptions& options, AskedPlane* plane);

}  // namespace slcmap
