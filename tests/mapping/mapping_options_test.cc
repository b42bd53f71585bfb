#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/io/yaml.h"
#include "mapping/mapping.h"
#include "odometry/options.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

MappingOptions Read(const std::string& yaml) {
  const testing::TempFolder folder;
  return MappingOptions::FromYaml(folder.Write("options.yaml", yaml));
}

TEST(MappingOptions, AFileOverridesItsKeysOnly) {
  const MappingOptions options =
      Read("window: {any: 1}\nmapping:\n  cloud: {voxel_m: 0.2}\n  occupancy: {max_range_m: 7}\n");
  EXPECT_EQ(options.cloud.voxel_m, 0.2);
  EXPECT_EQ(options.cloud.min_observations, MappingOptions().cloud.min_observations);
  EXPECT_EQ(options.occupancy.max_range_m, 7);
}

TEST(MappingOptions, UnknownKeysAndAbsurdValuesAreNamed) {
  EXPECT_THAT([] { Read("mapping: {clod: {}}"); }, ThrowsMessage<ConfigError>(HasSubstr("clod")));
  EXPECT_THAT([] { Read("mapping: {cloud: {voxel: 1}}"); },
              ThrowsMessage<ConfigError>(HasSubstr("voxel")));
  for (const char* key :
       {"max_sigma_m", "min_observations", "voxel_m", "outlier_neighbours", "outlier_sigmas"}) {
    EXPECT_THAT([&] { Read(std::string("mapping: {cloud: {") + key + ": -1}}"); },
                ThrowsMessage<ConfigError>(HasSubstr(key)));
  }
  for (const char* key : {"max_sigma_m", "min_observations"}) {
    EXPECT_THAT([&] { Read(std::string("mapping: {run_lines: {") + key + ": 0}}"); },
                ThrowsMessage<ConfigError>(HasSubstr(std::string("mapping.run_lines.") + key)));
  }
  for (const char* key : {"resolution_m", "max_range_m"}) {
    EXPECT_THAT([&] { Read(std::string("mapping: {occupancy: {") + key + ": 0}}"); },
                ThrowsMessage<ConfigError>(HasSubstr(key)));
  }
}

TEST(MappingOptions, OfTheAdjustmentAreNamedToo) {
  const MappingOptions options = Read(
      "mapping: {adjustment: {enabled: false, closures: {min_edges: 7}, calibration: {lever: "
      "true}}}");
  EXPECT_FALSE(options.adjustment.enabled);
  EXPECT_EQ(options.adjustment.closures.min_edges, 7);
  EXPECT_TRUE(options.adjustment.calibration.lever);
  EXPECT_THAT([] { Read("mapping: {adjustment: {clozures: {}}}"); },
              ThrowsMessage<ConfigError>(HasSubstr("clozures")));
  EXPECT_THAT([] { Read("mapping: {adjustment: {closures: {gate_m: -1}}}"); },
              ThrowsMessage<ConfigError>(HasSubstr("mapping.adjustment.closures.gate_m")));
  EXPECT_THAT([] { Read("mapping: {adjustment: {point_sigma_px: 0}}"); },
              ThrowsMessage<ConfigError>(HasSubstr("point_sigma_px")));
}

TEST(MappingOptions, ValuesOutOfRangeAreNamedWithTheirFileAndRange) {
  EXPECT_THAT([] { Read("mapping: {occupancy: {resolution_m: 1e300}}"); },
              ThrowsMessage<ConfigError>(
                  AllOf(HasSubstr("options.yaml: mapping.occupancy.resolution_m: found 1e+300"),
                        HasSubstr("expected 0.001 to 100"))));
  for (const char* yaml : {"cloud: {voxel_m: 1e-9}", "cloud: {outlier_neighbours: 1000000000}",
                           "occupancy: {max_range_m: 1e9}", "occupancy: {max_voxels: 0}",
                           "run_lines: {max_sigma_m: 1e9}", "lines: {sweep: {max_depth_m: 0}}"}) {
    EXPECT_THAT([&] { Read(std::string("mapping: {") + yaml + "}"); },
                ThrowsMessage<ConfigError>(HasSubstr("options.yaml: mapping.")));
  }
}

TEST(MappingOptions, ASectionOfNoStageIsRefusedByEachOfThem) {
  const testing::TempFolder folder;
  const std::string path = folder.Write("options.yaml", "mappin: {cloud: {voxel_m: 0.2}}\n");
  const auto unknown = ThrowsMessage<ConfigError>(HasSubstr("mappin: unknown key"));
  EXPECT_THAT([&] { MappingOptions::FromYaml(path); }, unknown);
  EXPECT_THAT([&] { OdometryOptions::FromYaml(path); }, unknown);
}

TEST(MappingOptions, EachStageLeavesTheSectionsOfTheOthers) {
  const testing::TempFolder folder;
  for (const std::string key : kConfigKeys) {
    const std::string path =
        folder.Write("options.yaml", key == "method" ? "method: slc\n" : key + ":\n");
    EXPECT_NO_THROW(MappingOptions::FromYaml(path)) << key;
    EXPECT_NO_THROW(OdometryOptions::FromYaml(path)) << key;
  }
}

TEST(MappingOptions, KeysOfRulesThatAreGoneAreTakenForAVersion) {
  EXPECT_NO_THROW(Read("mapping: {lines: {min_parallax_rad: 0.1, min_ghost_share: 0.5}}"));
  EXPECT_NO_THROW(Read("mapping: {lines: {neighbours: {reach_m: 3, max_neighbours: 40}}}"));
  EXPECT_NO_THROW(Read("mapping: {level_marks: {find: false}}"));
  EXPECT_NO_THROW(Read("mapping: {adjustment: {calibration: {principal_points: true}}}"));
  EXPECT_THAT(MappingOptions().ToYaml(), Not(AnyOf(HasSubstr("ghost"), HasSubstr("level_marks"))));
}

TEST(MappingOptions, BuildingAMapChecksThem) {
  MappingOptions options;
  options.occupancy.resolution_m = 0;
  EXPECT_THROW(MapRun({}, nullptr, options), ConfigError);
}

}  // namespace
}  // namespace slcmap
