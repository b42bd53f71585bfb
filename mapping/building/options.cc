#include "mapping/building/options.h"

#include "data/io/yaml.h"

namespace slcmap::inline mapping {
namespace {

constexpr OptionTable kTable{
    Option{"max_point_sigma_m", &BuildingOptions::max_point_sigma_m, 1e-4, 10.0},
    Option{"normal_tolerance_deg", &BuildingOptions::normal_tolerance_deg, 1.0, 45.0},
    Option{"merge_m", &BuildingOptions::merge_m, 1e-3, 0.5},
    Option{"min_face_m2", &BuildingOptions::min_face_m2, 1e-3, 100.0},
    Option{"join_gap_m", &BuildingOptions::join_gap_m, 0.0, 100.0},
    Option{"line_sample_m", &BuildingOptions::line_sample_m, 0.01, 10.0},
    Option{"shared_sigma_m", &BuildingOptions::shared_sigma_m, 0.0, 1.0},
    Option{"bend_length_m", &BuildingOptions::bend_length_m, 0.1, 1000.0},
    Option{"max_proud_m", &BuildingOptions::max_proud_m, 1e-3, 1.0},
    Option{"cell_m", &BuildingOptions::cell_m, 0.01, 0.5},
    Option{"behind_m", &BuildingOptions::behind_m, 0.01, 2.0},
    Option{"min_opening_m", &BuildingOptions::min_opening_m, 0.05, 10.0},
    Option{"snap_m", &BuildingOptions::snap_m, 0.0, 1.0},
    Option{"extension_m", &BuildingOptions::extension_m, 0.0, 100.0},
    Option{"border_cost_m", &BuildingOptions::border_cost_m, 1e-3, 100.0},
    Option{"max_door_width_m", &BuildingOptions::max_door_width_m, 0.1, 10.0},
    Option{"min_room_m2", &BuildingOptions::min_room_m2, 0.0, 1000.0},
    Option{"min_thickness_m", &BuildingOptions::min_thickness_m, 1e-3, 10.0},
    Option{"max_thickness_m", &BuildingOptions::max_thickness_m, 1e-3, 10.0},
    Option{"assumed_thickness_m", &BuildingOptions::assumed_thickness_m, 1e-3, 10.0},
    Option{"max_rays", &BuildingOptions::max_rays, 1000, 1000000000}};

constexpr char kSection[] = "mapping.building";

}  // namespace

void BuildingOptions::Check() const {
  kTable.Check(kSection, *this);
  CheckOrder(kSection, "min_thickness_m", min_thickness_m, "max_thickness_m", max_thickness_m);
}

void BuildingOptions::Read(YamlSection section) { kTable.Read(section, this); }

}  // namespace slcmap::mapping
