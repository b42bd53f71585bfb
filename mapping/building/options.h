// Options of mapping/building.
#pragma once

#include "data/io/yaml.h"

namespace slcmap::inline mapping {

struct BuildingOptions {
  double max_point_sigma_m = 0.05;  // points that are less certain are left out

  // Faces.
  double normal_tolerance_deg = 15;  // between a point's normal and that of its face
  double merge_m = 0.02;             // faces nearer than this, and than 2 sigma, are one
  double min_face_m2 = 0.15;         // of surface measured on it
  double join_gap_m = 3;             // pieces of one plane so far apart are one face
  double line_sample_m = 0.1;        // a line counts as points so far apart
  // The least standard deviation of a face's offset: what all measurements of it share.
  double shared_sigma_m = 0.003;
  double bend_length_m = 3;   // along which a wall's deviations from its plane are alike
  double max_proud_m = 0.04;  // how far what is fixed to a wall stands before it

  // Openings.
  double cell_m = 0.05;        // of the grid on a face, and of that of free space
  double behind_m = 0.15;      // a ray that ends so far behind a face went through it
  double min_opening_m = 0.4;  // width and height
  double snap_m = 0.05;        // to a line, or by 2 sigma of it

  // Rooms.
  double extension_m = 30;        // of a wall's line beyond what was measured of it, at most
  double border_cost_m = 0.25;    // of a border without a wall, as area of a cell by length
  double max_door_width_m = 1.3;  // rooms are parted at gaps of at most this width
  double min_room_m2 = 1.0;

  // Walls.
  double min_thickness_m = 0.05, max_thickness_m = 0.75;  // between faces of one wall
  double assumed_thickness_m = 0.15;                      // of a wall with one face

  int max_rays = 2000000;  // of the rays, beyond which only every so manieth is looked at

  void Check() const;  // throws ConfigError
  void Read(YamlSection section);
};

}  // namespace slcmap::mapping
