#include "mapping/planes/plane_options.h"

#include "data/option_table.h"

namespace slcmap {
namespace {

constexpr OptionTable kPlaneTable{
    Option{"fill", &PlaneOptions::fill, false, true},
    Option{"min_line_m", &PlaneOptions::min_line_m, 0.05, 100.0},
    Option{"min_surface_m2", &PlaneOptions::min_surface_m2, 0.01, 100.0},
    Option{"min_support_m2", &PlaneOptions::min_support_m2, 0.0, 1000.0},
    Option{"merge_m", &PlaneOptions::merge_m, 0.006, 0.5},
    Option{"reach_m", &PlaneOptions::reach_m, 0.0, 20.0},
    Option{"height_m", &PlaneOptions::height_m, 0.5, 20.0},
    Option{"patch_m", &PlaneOptions::patch_m, 0.05, 5.0},
    Option{"samples", &PlaneOptions::samples, 8, 200},
    Option{"min_images", &PlaneOptions::min_images, 2, 100},
    Option{"max_images", &PlaneOptions::max_images, 2, 100},
    Option{"window_views", &PlaneOptions::window_views, 1, 1000},
    Option{"min_parallax_deg", &PlaneOptions::min_parallax_deg, 0.0, 90.0},
    Option{"max_range_m", &PlaneOptions::max_range_m, 0.5, 100.0},
    Option{"max_grazing_deg", &PlaneOptions::max_grazing_deg, 10.0, 89.0},
    Option{"sweep_m", &PlaneOptions::sweep_m, 0.1, 5.0},
    Option{"sweep_step_m", &PlaneOptions::sweep_step_m, 0.005, 1.0},
    Option{"max_offset_m", &PlaneOptions::max_offset_m, 0.0, 1.0},
    Option{"min_correlation", &PlaneOptions::min_correlation, 0.0, 1.0},
    Option{"min_patches", &PlaneOptions::min_patches, 1, 1000000},
    Option{"min_plane_share", &PlaneOptions::min_plane_share, 0.0, 1.0},
    Option{"cell_m", &PlaneOptions::cell_m, 0.01, 0.1},
    Option{"max_passes", &PlaneOptions::max_passes, 0, 1000},
    Option{"behind_m", &PlaneOptions::behind_m, 0.0, 5.0}};

}  // namespace

void PlaneOptions::Check() const {
  kPlaneTable.Check("mapping.planes", *this);
  CheckOrder("mapping.planes", "min_images", min_images, "max_images", max_images);
  CheckOrder("mapping.planes", "max_offset_m", max_offset_m, "sweep_m", sweep_m);
  CheckOrder("mapping.planes", "sweep_step_m", sweep_step_m, "sweep_m", sweep_m);
}
void PlaneOptions::Read(YamlSection section) { kPlaneTable.Read(section, this); }

}  // namespace slcmap
