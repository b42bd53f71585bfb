#include "mapping/map/options.h"

#include "data/io/yaml.h"
#include "mapping/map/occupancy_map.h"

namespace slcmap::inline mapping {
namespace {

// What no building exceeds; options have an upper bound so that nonsense is found where it stands.
constexpr double kMaxLength_m = 1000;
constexpr int kMaxCount = 1000;

constexpr OptionTable kCloudTable{
    Option{"max_sigma_m", &CloudOptions::max_sigma_m, 1e-6, kMaxLength_m},
    Option{"min_observations", &CloudOptions::min_observations, 1, kMaxCount},
    Option{"voxel_m", &CloudOptions::voxel_m, kMinVoxel_m, kMaxVoxel_m},
    Option{"outlier_neighbours", &CloudOptions::outlier_neighbours, 1, kMaxCount},
    Option{"outlier_sigmas", &CloudOptions::outlier_sigmas, 1e-3, 1e3}};

constexpr OptionTable kOccupancyTable{
    Option{"resolution_m", &OccupancyOptions::resolution_m, kMinVoxel_m, kMaxVoxel_m},
    Option{"max_range_m", &OccupancyOptions::max_range_m, 1e-3, kMaxLength_m},
    Option{"max_voxels", &OccupancyOptions::max_voxels, 1, 1000000000}};

constexpr OptionTable kRunLinesTable{
    Option{"max_sigma_m", &RunLineOptions::max_sigma_m, 1e-6, kMaxLength_m},
    Option{"min_observations", &RunLineOptions::min_observations, 1, kMaxCount}};

}  // namespace

void CloudOptions::Check() const { kCloudTable.Check("mapping.cloud", *this); }
void CloudOptions::Read(YamlSection section) { kCloudTable.Read(section, this); }

void OccupancyOptions::Check() const { kOccupancyTable.Check("mapping.occupancy", *this); }
void OccupancyOptions::Read(YamlSection section) { kOccupancyTable.Read(section, this); }

void RunLineOptions::Check() const { kRunLinesTable.Check("mapping.run_lines", *this); }
void RunLineOptions::Read(YamlSection section) { kRunLinesTable.Read(section, this); }

}  // namespace slcmap::mapping
