// The options of surfaces that are filled between what was measured of them, and of edges at which
// planes of the building meet.
#pragma once

#include "data/io/yaml.h"

namespace slcmap::inline mapping {

inline constexpr double kFilledMaxOffset_m = 0.03;  // of their median from the plane

struct PlaneOptions {
  bool fill = true;
  double cell_m = 0.05;  // of a plane, that one point fills

  // Measured points are drawn to the plane that they are on, if they are at most so many standard
  // deviations off it (0: none are); and how far surfaces are off their planes.
  double draw_sigmas = 2, surface_sigma_m = 0.01;

  // What has to be measured around a cell.
  double beside_m = 0.15;  // on either side of the plane, in which they are looked for
  double reach_m = 0.5;    // from the nearest of them, along the plane

  void Check() const;  // throws ConfigError
  void Read(YamlSection section);
};

// The options of edges at which planes of the building meet.

struct JunctionOptions {
  bool add = true;

  // What has to be measured of both surfaces, or filled, at a place of a junction.
  double reach_m = 0.8;  // from the junction, along a plane

  void Check() const;  // throws ConfigError
  void Read(YamlSection section);
};

}  // namespace slcmap::mapping
