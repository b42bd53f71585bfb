// The options of odometry: those of its rooms, overridden by YAML, checked when built.
#pragma once

#include <string>

#include "odometry/frontend/options.h"
#include "odometry/window/options.h"

namespace slcmap::inline odometry {

// Everything that odometry can be configured with. YAML sections carry the names of the members.
struct OdometryOptions : EstimatorOptions {
  RectifierOptions rectifier;
  LineTrackerOptions lines;

  // Overrides the defaults with those of a file; throws ConfigError naming file and key.
  static OdometryOptions FromYaml(const std::string& path);
  // All options as such a file.
  std::string ToYaml() const;
  void Check() const;
};

}  // namespace slcmap::odometry
