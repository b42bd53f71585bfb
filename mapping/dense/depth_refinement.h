// Depth below the pixel: patches of a view's image compared with those of its neighbours.
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "data/core/types.h"
#include "mapping/views/stereo_depth.h"

namespace slcmap::inline mapping {

// An image at full, half and quarter size, float. Less noise is left at each level, and less of
// what bilinear interpolation makes of it, so that the faint texture of plaster tells there.
struct DepthPyramid {
  static constexpr int kLevels = 3;
  std::array<cv::Mat, kLevels> levels;  // none of an empty image

  DepthPyramid() = default;
  explicit DepthPyramid(const cv::Mat& image);  // 8 bit
  bool empty() const { return levels[0].empty(); }
};

// An image that sees what the reference sees: the right one of its pair, or that of another view.
struct NeighbourImage {
  const DepthPyramid* image = nullptr;
  RigidTransform T_neighbour_reference;
  double pose_sigma_px = 0;  // what its pose lets it be off
};

// Moves the inverse depth of each known node to where the patch around it, as the plane of the node
// maps it into the neighbours (all of the reference's camera model), is most alike there, up to
// brightness and contrast: Gauss-Newton in one unknown, a step a neighbour, combined by their
// information, with slopes fitted again to the nodes around in between. Patches are taken at full
// size, and where they fail there, at half and at quarter size, where they are larger. Sigma
// becomes that of the result. A node becomes unknown where too few neighbours agree, where its
// patch has no texture at any size, or where it ends far from where it began.
void RefineDepth(const DepthPyramid& reference, const std::vector<NeighbourImage>& neighbours,
                 const Camera& camera, DepthGrid* grid);

// Fits the slopes of each known node to the nodes around it that agree with it; nodes that have too
// few of them become unknown.
void SmoothSlopes(const Camera& camera, DepthGrid* grid);

}  // namespace slcmap::mapping
