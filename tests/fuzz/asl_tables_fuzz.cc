// ASL's tables of images and of IMU samples.
#include "data/source/asl_files.h"
#include "tests/fuzz/fuzz_target.h"

std::vector<std::string> slcmap::fuzz::Seeds() { return {}; }

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  using namespace slcmap;
  const std::string path = fuzz::FileOf("cam0/data.csv", bytes, size);
  Warnings warnings;
  fuzz::Refusing([&] { ReadAslImages(std::filesystem::path(path).parent_path(), &warnings); });
  fuzz::Refusing([&] { ReadAslImu(path, &warnings); });
  return 0;
}
