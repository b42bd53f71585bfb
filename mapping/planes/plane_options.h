// The options of planes that are filled where images agree with them.
#pragma once

#include "data/yaml_options.h"

namespace slcmap {

struct PlaneOptions {
  bool fill = false;  // measured on one building only so far, see README.md

  // Planes that structure suggests.
  double min_line_m = 0.5;      // of level lines that suggest an upright plane by themselves
  double min_surface_m2 = 0.2;  // of measured points that suggest a plane by themselves
  double min_support_m2 = 2.4;  // of both, that a plane needs
  double merge_m = 0.035;       // from a plane, what is a part of it
  double reach_m = 0.8;         // beyond what suggests it, along it
  double height_m = 3;          // the same up and down an upright plane

  // Patches of a plane, which are compared between images.
  double patch_m = 0.3;
  int samples = 24;  // along a side
  int min_images = 4, max_images = 10;
  int window_views = 30;          // on either side of the view that shows a patch best
  double min_parallax_deg = 1.2;  // between the images, seen from the patch
  double max_range_m = 5;
  double max_grazing_deg = 76;

  // What counts as agreement.
  double sweep_m = 0.32, sweep_step_m = 0.04;  // on either side of the plane
  double max_offset_m = 0.07;                  // of the best place from the plane
  double min_correlation = 0.45;               // mean over all pairs of images, on the plane
  int min_patches = 8;                         // of a plane, that agree
  double min_plane_share = 0.15;               // of the patches of a plane that are seen

  // What is filled.
  double cell_m = 0.05;
  int max_passes = 2;     // rays that may be measured through a cell
  double behind_m = 0.1;  // where they end behind it

  void Check() const;  // throws ConfigError
  void Read(YamlSection section);
};

}  // namespace slcmap
