// The options of surfaces that are filled between what was measured of them, and of edges at which
// planes of the building meet.
#pragma once

#include "data/io/yaml.h"

namespace slcmap::inline mapping {

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

// The options of edges at which planes of the building meet.

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

}  // namespace slcmap::mapping
