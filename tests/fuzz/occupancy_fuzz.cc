// OctoMap's .bt files.
#include "mapping/map/occupancy_map.h"
#include "tests/fuzz/fuzz_target.h"

std::vector<std::string> slcmap::fuzz::Seeds() {
  std::vector<std::string> seeds;
  for (const double size_m : {0.4, 3.0}) {
    OccupancyMap map(0.1);
    map.Insert({{{0, 0, 0}, {{size_m, 0, 0}, {size_m, 1, 0}, {size_m, 1, 1}}}}, 10);
    const std::string path = FileOf("seed.bt", nullptr, 0);
    map.Write(path);
    seeds.push_back(ReadFile(path));
  }
  return seeds;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  using namespace slcmap;
  const std::string path = fuzz::FileOf("occupancy.bt", bytes, size);
  fuzz::Refusing([&] { OccupancyMap::Read(path).OccupiedVoxels(); });
  return 0;
}
