// PLY files, of points and of lines.
#include "data/io/map_line.h"
#include "data/io/ply.h"
#include "tests/fuzz/fuzz_target.h"

std::vector<std::string> slcmap::fuzz::Seeds() { return {}; }

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  using namespace slcmap;
  const std::string path = fuzz::FileOf("lines.ply", bytes, size);
  fuzz::Refusing([&] { Positions(ReadPly(path).Get("vertex", path), path); });
  fuzz::Refusing([&] { ReadMapLines(path); });
  return 0;
}
