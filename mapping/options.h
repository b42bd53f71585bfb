// The options of every stage of mapping: defaults here, overridden by YAML, checked when used.
#pragma once

#include "data/yaml_options.h"
#include "mapping/adjustment/adjustment_options.h"
#include "mapping/building/building_options.h"
#include "mapping/dense/dense_options.h"
#include "mapping/given_poses/pose_options.h"
#include "mapping/junctions/junction_options.h"
#include "mapping/lines/line_options.h"
#include "mapping/pipes/pipe_options.h"
#include "mapping/planes/plane_options.h"

namespace slcmap {

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
  int max_voxels = 20000000;   // that a map may take, by an estimate; some 70 bytes of memory each
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

// Which stages are run for a map from images.
struct StageOptions {
  bool lines = true;     // from the images; else those of the run, as without images
  bool building = true;  // planes, rooms, plan, and what is filled and added by them
  void Check() const {}
  void Read(YamlSection section);
};

// Everything that mapping can be configured with. YAML sections carry the names of the members.
struct MappingOptions {
  StageOptions stages;
  CloudOptions cloud;
  OccupancyOptions occupancy;
  AdjustmentOptions adjustment;
  GivenPoseOptions given_poses;
  MapLineOptions lines;
  RunLineOptions run_lines;
  DenseOptions dense;
  PipeOptions pipes;
  PlaneOptions planes;
  JunctionOptions junctions;
  BuildingOptions building;

  // Overrides the defaults by the section `mapping` of a file; other sections, which belong to
  // other stages, are left alone. Throws ConfigError naming file and key, also for a value out of
  // its range.
  static MappingOptions FromYaml(const std::string& path);
  // All options as such a file.
  std::string ToYaml() const;
  void Check() const;
  // Of all stages that have some.
  void SetThreads(int threads);
};

}  // namespace slcmap
