// The true surfaces of a building, as faces.
#include "apps/evaluation/truth.h"
#include "data/io/ply.h"
#include "tests/fuzz/fuzz_target.h"

std::vector<std::string> slcmap::fuzz::Seeds() {
  PlyElement vertices{"vertex", {}};
  for (const char* name : {"x", "y", "z"}) vertices.Add(name, PlyType::kFloat);
  for (const double z : {0, 3}) {
    for (const auto& [x, y] : {std::pair{0, 0}, {4, 0}, {4, 4}, {0, 4}}) {
      vertices.AppendRow({static_cast<double>(x), static_cast<double>(y), z});
    }
  }
  const testing::TempFolder folder;
  WritePly(folder.Path("room.ply"),
           {{}, {vertices}, {{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 5, 4}, {2, 3, 7}}});
  return CollectFiles(folder.Path());
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  using namespace slcmap;
  const std::string path = fuzz::FileOf("surfaces.ply", bytes, size);
  fuzz::Refusing([&] { ReadSurfaces(path); });
  return 0;
}
