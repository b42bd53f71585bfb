#include "mapping/surfaces/options.h"

#include "data/io/yaml.h"

namespace slcmap::inline mapping {
namespace {

constexpr OptionTable kPlaneTable{
    Option{"fill", &PlaneOptions::fill, false, true},
    Option{"cell_m", &PlaneOptions::cell_m, 0.01, 0.1},
    Option{"draw_sigmas", &PlaneOptions::draw_sigmas, 0.0, 10.0},
    Option{"surface_sigma_m", &PlaneOptions::surface_sigma_m, 0.001, 1.0},
    Option{"beside_m", &PlaneOptions::beside_m, 0.02, 1.0},
    Option{"reach_m", &PlaneOptions::reach_m, 0.0, 20.0}};

}  // namespace

void PlaneOptions::Check() const { kPlaneTable.Check("mapping.planes", *this); }
void PlaneOptions::Read(YamlSection section) {
  kPlaneTable.Read(section, this,
                   {"neighbours", "agree_m", "min_share", "max_offset_m", "room_reach_m",
                    "min_bounded", "storey_reach_m", "blank_reach_m", "blank_clear_m",
                    "max_sigma_m", "max_range_m", "max_grazing_deg", "max_passes", "behind_m"});
}

namespace {

constexpr OptionTable kJunctionTable{Option{"add", &JunctionOptions::add, false, true},
                                     Option{"reach_m", &JunctionOptions::reach_m, 0.05, 2.0}};

}  // namespace

void JunctionOptions::Check() const { kJunctionTable.Check("mapping.junctions", *this); }
void JunctionOptions::Read(YamlSection section) {
  kJunctionTable.Read(section, this,
                      {"bin_m", "beside_m", "window_m", "min_points", "max_gap_m", "offset_reach_m",
                       "corner_m", "known_m", "min_length_m", "close_gap_m"});
}

}  // namespace slcmap::mapping
