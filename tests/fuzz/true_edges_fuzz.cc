// The true edges of a building, as a table.
#include "apps/evaluation/truth.h"
#include "tests/fuzz/fuzz_target.h"

std::vector<std::string> slcmap::fuzz::Seeds() { return {}; }

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  using namespace slcmap;
  const std::string path = fuzz::FileOf("edges.csv", bytes, size);
  fuzz::Refusing([&] { ReadTrueEdges(path); });
  return 0;
}
