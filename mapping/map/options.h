// The options of what a map is made of besides lines of images and dense points.
#pragma once

#include "data/io/yaml.h"

namespace slcmap::inline mapping {

// Which landmarks become points of the cloud.
struct CloudOptions {
  double max_sigma_m = 0.2;     // of a landmark along its ray
  int min_observations = 3;     // keyframes that saw it
  double voxel_m = 0.05;        // landmarks in one voxel become one point
  int outlier_neighbours = 12;  // of a point, that its mean distance is measured to
  double outlier_sigmas = 2.5;  // a mean distance so far above the cloud's average: an outlier
  void Check() const;           // throws ConfigError
  void Read(YamlSection section);
};

struct OccupancyOptions {
  double resolution_m = 0.05;  // edge of a voxel
  double max_range_m = 20;     // a ray is followed no further
  int max_voxels = 20000000;   // that a map may take; some 70 bytes of memory each
  void Check() const;
  void Read(YamlSection section);
};

// Which lines of the run become lines of a map that is made without images. The run reports all
// that it has estimated.
struct RunLineOptions {
  double max_sigma_m = 0.0085;  // of a line's middle across it
  int min_observations = 4;     // keyframes that saw it
  void Check() const;
  void Read(YamlSection section);
};

}  // namespace slcmap::mapping
