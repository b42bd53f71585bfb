// Options of mapping/building.
#pragma once

#include "data/io/yaml.h"

namespace slcmap::inline mapping {

inline constexpr double kBuildingLineSample_m = 0.1;  // a line counts as points so far apart
// The least standard deviation of a face's offset: what all measurements of it share.
inline constexpr double kBuildingSharedSigma_m = 0.003;
// along which a wall's deviations from its plane are alike
inline constexpr double kBuildingBendLength_m = 3;
inline constexpr double kBuildingMinOpening_m = 0.4;  // width and height

struct BuildingOptions {
  // Faces.
  double merge_m = 0.02;  // faces nearer than this, and than 2 sigma, are one

  // Openings.
  double cell_m = 0.05;  // of the grid on a face, and of that of free space

  // Walls.
  double min_thickness_m = 0.05, max_thickness_m = 0.75;  // between faces of one wall
  double assumed_thickness_m = 0.15;                      // of a wall with one face

  // Rooms.
  double min_room_m2 = 1;

  void Check() const;  // throws ConfigError
  void Read(YamlSection section);
};

}  // namespace slcmap::mapping
