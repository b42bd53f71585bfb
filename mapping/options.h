// The options of every stage of mapping: defaults here, overridden by YAML, checked when used.
#pragma once

#include "data/io/yaml.h"
#include "mapping/adjustment/options.h"
#include "mapping/building/options.h"
#include "mapping/external_poses/options.h"
#include "mapping/lines/options.h"
#include "mapping/map/options.h"
#include "mapping/pipes/pipes.h"
#include "mapping/surfaces/options.h"
#include "mapping/views/options.h"

namespace slcmap::inline mapping {

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
  ExternalPoseOptions given_poses;
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
  static MappingOptions FromYaml(const std::string& path,
                                 ConfigOrigin origin = ConfigOrigin::kUser);
  // All options as such a file.
  std::string ToYaml() const;
  void Check() const;
};

}  // namespace slcmap::mapping
