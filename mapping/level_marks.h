// Marks on floors and ceilings: joints, stripes, prints and shadows that looked like edges while
// only the surfaces around a line were asked.
#pragma once

#include <vector>

#include "data/map_line.h"
#include "data/yaml_options.h"
#include "mapping/building/building.h"
#include "mapping/dense/dense_point.h"

namespace slcmap {

struct LevelMarkOptions {
  bool find = true;
  double max_off_m = 0.03;  // of a line, and of points on the surface, from a floor or a ceiling
  double beside_m = 0.12;   // of a line: points up to there count
  double height_m = 0.4;    // over the surface, up to which something stands beside a line
  // Shares of the points that a whole surface would have: of what stands beside a mark at most, and
  // of the floor or ceiling on each of its sides at least.
  double max_standing = 0.1, min_flat = 0.1;
  void Check() const;  // throws ConfigError
  void Read(YamlSection section);
};

// Lines that run flat on a floor or a ceiling that goes on at both of their sides, with nothing
// that stands on it or hangs from it there, become marks. Those of unknown kind stay, of which the
// cloud says too little. It is fused by voxel_m, and filled.
void TellLevelMarks(const Building& building, const std::vector<DensePoint>& cloud, double voxel_m,
                    const LevelMarkOptions& options, std::vector<MapLine>* lines);

}  // namespace slcmap
