// The JSON files of a building, mapped or true, each as every other.
#include "data/io/true_building.h"
#include "mapping/map/building.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/testing/made_building.h"

std::vector<std::string> slcmap::fuzz::Seeds() {
  const testing::TempFolder folder;
  WriteBuilding(folder.Path(), testing::MakeBuilding(2));
  WriteTrueBuilding(folder.Path("building.json"), {});
  std::vector<std::string> seeds;
  for (const std::string& name : BuildingFiles()) seeds.push_back(ReadFile(folder.Path(name)));
  seeds.push_back(ReadFile(folder.Path("building.json")));
  return seeds;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  using namespace slcmap;
  const std::string path = fuzz::FileOf("building.json", bytes, size);
  fuzz::Refusing([&] { ReadTrueBuilding(path); });
  for (const std::string& name : BuildingFiles()) {
    const testing::TempFolder folder;
    WriteBuilding(folder.Path(), testing::MakeBuilding(2));
    folder.Write(name, std::string(reinterpret_cast<const char*>(bytes), size));
    fuzz::Refusing([&] { ReadBuilding(folder.Path()); });
  }
  return 0;
}
