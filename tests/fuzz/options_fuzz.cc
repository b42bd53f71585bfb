// The YAML files of --config.
#include "mapping/options.h"
#include "odometry/options.h"
#include "tests/fuzz/fuzz_target.h"

std::vector<std::string> slcmap::fuzz::Seeds() { return {}; }

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  using namespace slcmap;
  const std::string path = fuzz::FileOf("options.yaml", bytes, size);
  fuzz::Refusing([&] { OdometryOptions::FromYaml(path).Check(); });
  fuzz::Refusing([&] { MappingOptions::FromYaml(path).Check(); });
  return 0;
}
