#include "mapping/surfaces/options.h"

#include "data/io/yaml.h"

namespace slcmap::inline mapping {
namespace {

constexpr OptionTable kPlaneTable{
    Option{"fill", &PlaneOptions::fill, false, true},
    Option{"cell_m", &PlaneOptions::cell_m, 0.01, 0.1},
    Option{"draw_sigmas", &PlaneOptions::draw_sigmas, 0.0, 10.0},
    Option{"surface_sigma_m", &PlaneOptions::surface_sigma_m, 0.001, 1.0},
    Option{"neighbours", &PlaneOptions::neighbours, 3, 100},
    Option{"beside_m", &PlaneOptions::beside_m, 0.02, 1.0},
    Option{"agree_m", &PlaneOptions::agree_m, 0.001, 0.5},
    Option{"min_share", &PlaneOptions::min_share, 0.5, 1.0},
    Option{"max_offset_m", &PlaneOptions::max_offset_m, 0.0, 1.0},
    Option{"reach_m", &PlaneOptions::reach_m, 0.0, 20.0},
    Option{"room_reach_m", &PlaneOptions::room_reach_m, 0.0, 20.0},
    Option{"storey_reach_m", &PlaneOptions::storey_reach_m, 0.0, 20.0},
    Option{"min_bounded", &PlaneOptions::min_bounded, 0.0, 1.0},
    Option{"blank_reach_m", &PlaneOptions::blank_reach_m, 0.0, 20.0},
    Option{"blank_clear_m", &PlaneOptions::blank_clear_m, 0.0, 20.0},
    Option{"max_sigma_m", &PlaneOptions::max_sigma_m, 0.0, 10.0},
    Option{"max_range_m", &PlaneOptions::max_range_m, 0.5, 100.0},
    Option{"max_grazing_deg", &PlaneOptions::max_grazing_deg, 10.0, 89.0},
    Option{"max_passes", &PlaneOptions::max_passes, 0, 1000},
    Option{"behind_m", &PlaneOptions::behind_m, 0.0, 5.0}};

}  // namespace

void PlaneOptions::Check() const {
  kPlaneTable.Check("mapping.planes", *this);
  CheckOrder("mapping.planes", "max_offset_m", max_offset_m, "beside_m", beside_m);
}
void PlaneOptions::Read(YamlSection section) { kPlaneTable.Read(section, this); }

namespace {

constexpr OptionTable kJunctionTable{
    Option{"add", &JunctionOptions::add, false, true},
    Option{"bin_m", &JunctionOptions::bin_m, 0.01, 0.5},
    Option{"beside_m", &JunctionOptions::beside_m, 0.005, 0.5},
    Option{"reach_m", &JunctionOptions::reach_m, 0.05, 2.0},
    Option{"window_m", &JunctionOptions::window_m, 0.0, 1.0},
    Option{"min_points", &JunctionOptions::min_points, 1, 1000},
    Option{"max_gap_m", &JunctionOptions::max_gap_m, 0.0, 2.0},
    Option{"offset_reach_m", &JunctionOptions::offset_reach_m, 0.05, 5.0},
    Option{"corner_m", &JunctionOptions::corner_m, 0.0, 0.5},
    Option{"known_m", &JunctionOptions::known_m, 0.0, 0.5},
    Option{"min_length_m", &JunctionOptions::min_length_m, 0.0, 10.0},
    Option{"close_gap_m", &JunctionOptions::close_gap_m, 0.0, 1.0}};

}  // namespace

void JunctionOptions::Check() const {
  kJunctionTable.Check("mapping.junctions", *this);
  CheckOrder("mapping.junctions", "corner_m", corner_m, "reach_m", reach_m);
}
void JunctionOptions::Read(YamlSection section) { kJunctionTable.Read(section, this); }

}  // namespace slcmap::mapping
