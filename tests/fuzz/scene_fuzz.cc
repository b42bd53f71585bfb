// The simulator's description of a building.
#include "data/simulator/scene/scene.h"
#include "tests/fuzz/fuzz_target.h"

std::vector<std::string> slcmap::fuzz::Seeds() {
  return CollectFiles(SLCMAP_SOURCE_DIR "/config/scenes");
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  using namespace slcmap;
  const std::string path = fuzz::FileOf("scene.yaml", bytes, size);
  fuzz::Refusing([&] { ReadScene(path); });
  return 0;
}
