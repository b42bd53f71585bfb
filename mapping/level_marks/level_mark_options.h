// The options of marks on floors and ceilings.
#pragma once

#include "data/yaml_options.h"

namespace slcmap {

struct LevelMarkOptions {
  bool find = true;
  double max_off_m = 0.03;  // of a line, and of points on the surface, from a floor or a ceiling
  double beside_m = 0.12;   // of a line: points up to there count
  double height_m = 0.4;    // over the surface, up to which something stands beside a line
  // Shares of the cells every 30 cm along a line that hold points: over the surface at most, and on
  // each of its sides at least.
  double max_standing = 0.1, min_flat = 0.2;
  double min_share = 0.7;  // of a line where this holds
  void Check() const;      // throws ConfigError
  void Read(YamlSection section);
};

}  // namespace slcmap
