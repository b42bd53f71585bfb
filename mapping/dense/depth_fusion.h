// Depth that other views agree with, and that of many views as one cloud of points with normals.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "data/core/types.h"
#include "mapping/map/map.h"
#include "mapping/views/stereo_depth.h"

namespace slcmap::inline mapping {

// A view's depth and where it was seen from.
struct PlacedGrid {
  RigidTransform T_world_camera;
  const DepthGrid* grid = nullptr;
};

// The nodes of `view` that at least three views (itself, and others more than 0.1 m
// from it and from each other) agree with, within two standard deviations, and fewer
// contradict: those that see further at its place. The others become unknown.
DepthGrid ConfirmedDepth(const PlacedGrid& view, const std::vector<PlacedGrid>& others,
                         const Camera& camera, const DenseOptions& options);

// Sums what views see in voxels; surfaces that face different ways, as the two sides of a thin
// wall, are kept apart. Memory grows with the surface, not with the number of views.
class DepthFusion {
 public:
  explicit DepthFusion(const DenseOptions& options) : options_(options) {}

  // Adds the known nodes whose depth is certain to max_sigma_m, weighted by their information.
  void Add(const RigidTransform& T_world_camera, const Camera& camera, const DepthGrid& grid);

  // Adds a point that was fused before, as of another map.
  void Add(const DensePoint& point) {
    Add(point.p_world, point.normal_world.cast<float>(), static_cast<float>(point.sigma_m),
        point.grey);
  }

  // One point a voxel that is known to about the voxel's size. Surfaces that noise has spread over
  // voxels are drawn together along their normals: each point is moved onto the plane of those
  // around it, and of several along a normal the best known stays. By voxel, so that the order of
  // Add does not tell.
  std::vector<DensePoint> Points() const;

 private:
  struct Sums {
    Eigen::Vector3d weighted_p = Eigen::Vector3d::Zero();
    Eigen::Vector3f weighted_normal = Eigen::Vector3f::Zero();
    float weight = 0, weighted_grey = 0;
    int count = 0;
  };

  void Add(const Eigen::Vector3d& p, const Eigen::Vector3f& normal, float sigma_m, float grey);

  const DenseOptions options_;
  std::unordered_map<int64_t, Sums> voxels_;
};

}  // namespace slcmap::mapping
