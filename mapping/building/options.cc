#include "mapping/building/options.h"

#include "data/io/yaml.h"

namespace slcmap::inline mapping {
namespace {

constexpr OptionTable kTable{
    Option{"merge_m", &BuildingOptions::merge_m, 1e-3, 0.5},
    Option{"cell_m", &BuildingOptions::cell_m, 0.01, 0.5},
    Option{"min_thickness_m", &BuildingOptions::min_thickness_m, 1e-3, 10.0},
    Option{"max_thickness_m", &BuildingOptions::max_thickness_m, 1e-3, 10.0},
    Option{"assumed_thickness_m", &BuildingOptions::assumed_thickness_m, 1e-3, 10.0},
    Option{"min_room_m2", &BuildingOptions::min_room_m2, 0.0, 1000.0}};

constexpr char kSection[] = "mapping.building";

}  // namespace

void BuildingOptions::Check() const {
  kTable.Check(kSection, *this);
  CheckOrder(kSection, "min_thickness_m", min_thickness_m, "max_thickness_m", max_thickness_m);
}

void BuildingOptions::Read(YamlSection section) {
  kTable.Read(
      section, this,
      {"max_point_sigma_m", "normal_tolerance_deg", "min_face_m2", "join_gap_m", "line_sample_m",
       "shared_sigma_m", "bend_length_m", "max_proud_m", "behind_m", "min_opening_m", "snap_m",
       "extension_m", "border_cost_m", "max_rays", "max_door_width_m"});
}

}  // namespace slcmap::mapping
