// The points of a map with their tracks, as COLMAP's model has them.
#pragma once

#include <vector>

#include "export/model_images.h"
#include "mapping/map.h"

namespace slcmap {

// A point in an image of the model, by its place there.
struct ModelSight {
  std::size_t image = 0;  // its place among the model's images
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
};

struct ModelPoint {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  double error_px = -1;  // mean distance of its sights from its projections; -1 without any
  std::vector<ModelSight> track;
};

// A point for each track of each of the map's points, put where the model's images and poses see it
// best: points that the map has fused of several features are beside all of them. Sights that are
// then more than 4 px off are left out, and tracks of which less than two images are left. A point
// without tracks comes as it is, and is seen by none.
std::vector<ModelPoint> ModelPoints(const MapResult& map, const std::vector<ModelImage>& images);

}  // namespace slcmap
