// The options of edges at which planes of the building meet.
#pragma once

#include "data/yaml_options.h"

namespace slcmap {

struct JunctionOptions {
  bool add = true;
  double bin_m = 0.05;  // along a junction

  // What has to be measured of both surfaces, or filled, at a place of a junction.
  double beside_m = 0.03;  // on either side of a plane, in which its points are
  double reach_m = 0.8;    // from the junction, along a plane
  double window_m = 0.1;   // to either side along the junction
  int min_points = 4;      // in there, of each plane
  double max_gap_m = 0.6;  // from the junction to the nearest of them

  // Where surfaces are off their planes, around a place.
  double offset_reach_m = 1.0;  // along the planes
  double corner_m = 0.05;       // from the junction, in which points are of neither surface

  double known_m = 0.05;      // from a line of the images, in which nothing is added
  double min_length_m = 0.3;  // of what is added
  double close_gap_m = 0.1;   // in it, that is closed

  void Check() const;  // throws ConfigError
  void Read(YamlSection section);
};

}  // namespace slcmap
