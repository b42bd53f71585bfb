#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <memory>
#include <sstream>
#include <string>

#include "data/io/yaml.h"
#include "mapping/mapping.h"
#include "mapping/options.h"
#include "odometry/options.h"
#include "tests/testing/temp_folder.h"

namespace slcmap {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

MappingOptions Read(const std::string& yaml) {
  const testing::TempFolder folder;
  return MappingOptions::FromYaml(folder.Write("options.yaml", yaml));
}

TEST(MappingOptions, AFileOverridesItsKeysOnly) {
  const MappingOptions options = Read(
      "window: {any: 1}\nmapping:\n  cloud: {voxel_m: 0.2}\n  occupancy: {max_range_m: 7}\n"
      "  adjustment: {enabled: false, closures: {min_edges: 7}, calibration: {lever: true}}\n");
  EXPECT_EQ(options.cloud.voxel_m, 0.2);
  EXPECT_EQ(options.cloud.min_observations, MappingOptions().cloud.min_observations);
  EXPECT_EQ(options.occupancy.max_range_m, 7);
  EXPECT_FALSE(options.adjustment.enabled);
  EXPECT_EQ(options.adjustment.closures.min_edges, 7);
  EXPECT_TRUE(options.adjustment.calibration.lever);
}

TEST(MappingOptions, UnknownKeysAndAbsurdValuesAreNamedWithFileKeyAndRange) {
  for (const auto& [yaml, words] : std::vector<std::pair<const char*, const char*>>{
           {"clod: {}", "clod"},
           {"cloud: {voxel: 1}", "voxel"},
           {"cloud: {max_sigma_m: -1}", "options.yaml: mapping.cloud.max_sigma_m"},
           {"cloud: {min_observations: -1}", "mapping.cloud.min_observations"},
           {"cloud: {voxel_m: 1e-9}", "mapping.cloud.voxel_m"},
           {"cloud: {outlier_neighbours: -1}", "mapping.cloud.outlier_neighbours"},
           {"cloud: {outlier_neighbours: 1000000000}", "mapping.cloud.outlier_neighbours"},
           {"cloud: {outlier_sigmas: -1}", "mapping.cloud.outlier_sigmas"},
           {"run_lines: {max_sigma_m: 0}", "mapping.run_lines.max_sigma_m"},
           {"run_lines: {max_sigma_m: 1e9}", "mapping.run_lines.max_sigma_m"},
           {"run_lines: {min_observations: 0}", "mapping.run_lines.min_observations"},
           {"occupancy: {resolution_m: 0}", "mapping.occupancy.resolution_m"},
           {"occupancy: {resolution_m: 1e300}",
            "options.yaml: mapping.occupancy.resolution_m: found 1e+300, expected 0.001 to 100"},
           {"occupancy: {max_range_m: 1e9}", "mapping.occupancy.max_range_m"},
           {"occupancy: {max_voxels: 0}", "mapping.occupancy.max_voxels"},
           {"lines: {sweep: {max_depth_m: 0}}", "mapping.lines.sweep.max_depth_m"},
           {"adjustment: {clozures: {}}", "clozures"},
           {"adjustment: {closures: {gate_m: -1}}", "mapping.adjustment.closures.gate_m"},
           {"adjustment: {point_sigma_px: 0}", "mapping.adjustment.point_sigma_px"}}) {
    EXPECT_THAT(testing::MessageOf<ConfigError>(
                    [&, text = yaml] { Read(std::string("mapping: {") + text + "}"); }),
                HasSubstr(words));
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

// The option files of config/options, which users start from.

const std::string kSampleOptions = SLCMAP_SOURCE_DIR "/config/options";

TEST(SampleOptions, AreReadWithoutComplaint) {
  std::ostringstream log;
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(
      std::make_shared<spdlog::logger>("", std::make_shared<spdlog::sinks::ostream_sink_st>(log)));
  int files = 0;
  for (const auto& file : std::filesystem::directory_iterator(kSampleOptions)) {
    EXPECT_NO_THROW(OdometryOptions::FromYaml(file.path())) << file.path();
    EXPECT_NO_THROW(MappingOptions::FromYaml(file.path())) << file.path();
    ++files;
  }
  spdlog::set_default_logger(before);
  EXPECT_GE(files, 3);
  EXPECT_EQ(log.str(), "");  // of keys that are gone
}

TEST(SampleOptions, AllHoldsTheDefaults) {
  const std::string path = kSampleOptions + "/all.yaml";
  EXPECT_EQ(OdometryOptions::FromYaml(path).ToYaml(), OdometryOptions().ToYaml());
  EXPECT_EQ(MappingOptions::FromYaml(path).ToYaml(), MappingOptions().ToYaml());
}

}  // namespace
}  // namespace slcmap
