// Which parts of a building's true surfaces the cameras saw, from true poses.
#pragma once

#include <string>
#include <vector>

#include "apps/evaluation/triangle_tree.h"
#include "data/progress.h"
#include "data/trajectory.h"
#include "data/types.h"

namespace slcmap {

struct VisibilityOptions {
  double interval_s = 0.25;  // between the poses that are looked from
  int stride_px = 6;         // between the rays of an image
  double max_range_m = 8;    // what is further away was not seen
  double cell_m = 0.05;      // a sample of the surfaces a cube of this edge
  void Check() const;        // throws ConfigError
};

// A point of a surface, and the least distance from which a camera saw it.
struct SeenSample {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  double range_m = 0;
};

// What one image saw: rays from its camera (metres, world), whose ends lie on surfaces.
struct ReferenceView {
  Eigen::Vector3d p_camera = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> ends;
};

// The poses that are at least interval_s apart, from the first one on.
Trajectory PosesApart(const Trajectory& poses, double interval_s);

// The rays of the left camera up to max_range_m, at poses interval_s apart. Throws StoppedError
// when progress says so.
std::vector<ReferenceView> ReferenceViews(const TriangleTree& surfaces, const Trajectory& truth,
                                          const Rig& rig, const VisibilityOptions& options,
                                          const Progress& progress = {});

// The surfaces that the views saw, a sample a cell: evenly over them, however often they were seen.
std::vector<SeenSample> SeenSurfaces(const std::vector<ReferenceView>& views, double cell_m);

}  // namespace slcmap
