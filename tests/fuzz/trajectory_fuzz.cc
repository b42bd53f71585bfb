// Trajectories of TUM and EuRoC.
#include "data/io/trajectory.h"
#include "tests/fuzz/fuzz_target.h"

std::vector<std::string> slcmap::fuzz::Seeds() { return {}; }

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  using namespace slcmap;
  const std::string path = fuzz::FileOf("trajectory.txt", bytes, size);
  fuzz::Refusing([&] { ReadTrajectory(path); });
  fuzz::Refusing([&] { ReadTumTrajectory(path); });
  return 0;
}
