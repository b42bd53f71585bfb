#include "mapping/dense/dense_options.h"

#include "data/option_table.h"
#include "mapping/octree_file.h"

namespace slcmap {
namespace {

constexpr OptionTable kDenseTable{
    Option{"min_travel_m", &DenseOptions::min_travel_m, 0.0, 10.0},
    Option{"min_turn_rad", &DenseOptions::min_turn_rad, 0.0, 3.0},
    Option{"min_depth_m", &DenseOptions::min_depth_m, 0.05, 100.0},
    Option{"max_depth_m", &DenseOptions::max_depth_m, 0.1, 1000.0},
    Option{"grid_px", &DenseOptions::grid_px, 1, 64},
    Option{"uniqueness_percent", &DenseOptions::uniqueness_percent, 0, 100},
    Option{"max_grazing_deg", &DenseOptions::max_grazing_deg, 10.0, 90.0},
    Option{"pair_sigma_px", &DenseOptions::pair_sigma_px, 0.0, 10.0},
    Option{"pose_sigma_px", &DenseOptions::pose_sigma_px, 0.0, 10.0},
    Option{"neighbours", &DenseOptions::neighbours, 0, 16},
    Option{"window_views", &DenseOptions::window_views, 1, 100},
    Option{"min_views", &DenseOptions::min_views, 1, 100},
    Option{"min_baseline_m", &DenseOptions::min_baseline_m, 0.0, 10.0},
    Option{"agree_sigmas", &DenseOptions::agree_sigmas, 0.1, 10.0},
    Option{"voxel_m", &DenseOptions::voxel_m, kMinVoxel_m, 1.0},
    Option{"max_sigma_m", &DenseOptions::max_sigma_m, 1e-3, 10.0}};

}  // namespace

void DenseOptions::Check() const {
  kDenseTable.Check("mapping.dense", *this);
  CheckOrder("mapping.dense", "min_depth_m", min_depth_m, "max_depth_m", max_depth_m);
}
void DenseOptions::Read(YamlSection section) {
  section.Skip("threads");  // as options.yaml of earlier maps has it
  kDenseTable.Read(section, this);
}

}  // namespace slcmap
