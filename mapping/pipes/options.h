// The options of the pipe stage.
#pragma once

#include "data/io/yaml.h"

namespace slcmap::inline mapping {

struct PipeOptions {
  bool find = true;
  double min_radius_m = 0.015, max_radius_m = 0.32;
  double min_length_m = 0.75;
  void Check() const;  // throws ConfigError
  void Read(YamlSection section);
};

}  // namespace slcmap::mapping
