// The options of surfaces that are filled between what was measured of them.
#pragma once

#include "data/yaml_options.h"

namespace slcmap {

struct PlaneOptions {
  bool fill = true;
  double cell_m = 0.05;  // of a plane, that one point fills

  // Measured points are drawn to the plane that they are on, if they are at most so many standard
  // deviations off it (0: none are); and how far surfaces are off their planes.
  double draw_sigmas = 2, surface_sigma_m = 0.01;

  // What has to be measured around a cell.
  int neighbours = 8;           // of the measured points nearest to it along the plane
  double beside_m = 0.15;       // on either side of the plane, in which they are looked for
  double agree_m = 0.015;       // from their median, of those that are on one surface
  double min_share = 0.75;      // of them, that is on one
  double max_offset_m = 0.03;   // of their median from the plane
  double reach_m = 0.5;         // from the nearest of them, along the plane
  double room_reach_m = 4;      // the same on floors and ceilings of rooms that walls bound,
  double min_bounded = 0.6;     // on this share of their border
  double storey_reach_m = 1.5;  // the same at a storey's heights, where no room was found

  // Where what is around is not on one surface, as it is little: on the plane itself.
  double blank_reach_m = 3;    // of walls: from points and lines in the plane, along it
  double blank_clear_m = 0.1;  // from what was measured beside the plane
  double max_sigma_m = 0.04;   // of the plane

  // What cameras have to see of it.
  double max_range_m = 8;
  double max_grazing_deg = 85;
  int max_passes = 2;     // rays that may be measured through a cell
  double behind_m = 0.1;  // where they end behind it

  void Check() const;  // throws ConfigError
  void Read(YamlSection section);
};

}  // namespace slcmap
