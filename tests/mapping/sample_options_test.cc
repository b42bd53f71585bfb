// The option files of config/options, which users start from.
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <memory>
#include <sstream>
#include <string>

#include "mapping/options.h"
#include "odometry/options.h"

namespace slcmap {
namespace {

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
