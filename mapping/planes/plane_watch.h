// Whether any view looks at a place of a surface.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mapping/lines/sight_depths.h"
#include "mapping/lines/view_cameras.h"
#include "mapping/planes/plane_options.h"

namespace slcmap {

// The left images of a rig's views. What is given has to live on.
class PlaneWatch {
 public:
  // Hidden is what one of the depths hides.
  PlaneWatch(const ViewCameras& cameras, const std::vector<SightDepths>& depths,
             const PlaneOptions& options);

  // From before the surface, near and steeply enough, past all that hides it. Neighbouring places
  // are seen by the same view, which is asked first.
  bool Sees(const Eigen::Vector3d& p_world, const Eigen::Vector3d& normal_world);

 private:
  bool SeesFrom(int view, const Eigen::Vector3d& p_world,
                const Eigen::Vector3d& normal_world) const;

  const ViewCameras& cameras_;
  const std::vector<SightDepths>& depths_;
  const double max_range_m_, min_cosine_;
  std::vector<Eigen::Vector3d> centres_;
  int last_ = 0;
};

}  // namespace slcmap
