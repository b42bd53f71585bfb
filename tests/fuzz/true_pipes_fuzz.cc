// The true pipes of a building, as a table.
#include "data/io/map_line.h"
#include "tests/fuzz/fuzz_target.h"

std::vector<std::string> slcmap::fuzz::Seeds() {
  std::vector<TruePipe> pipes(3);
  for (size_t i = 0; i < pipes.size(); ++i) {
    pipes[i].id = static_cast<int64_t>(i);
    pipes[i].start_world.x() = 0.5 * static_cast<double>(i);
    pipes[i].end_world = pipes[i].start_world + Eigen::Vector3d(0, 0, 3);
    pipes[i].radius_m = 0.05;
  }
  pipes[0].seen = {{0, 1.5}, {2, 2.5}};
  pipes[1].seen = {{0.25, 3}};
  const testing::TempFolder folder;
  WriteTruePipes(folder.Path("pipes.csv"), pipes);
  return CollectFiles(folder.Path());
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  using namespace slcmap;
  const std::string path = fuzz::FileOf("pipes.csv", bytes, size);
  fuzz::Refusing([&] { ReadTruePipes(path); });
  return 0;
}
