#include "mapping/junctions/junction_options.h"

#include "data/option_table.h"

namespace slcmap {
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

}  // namespace slcmap
