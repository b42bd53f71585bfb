// A Kalibr camera chain, and Kalibr's IMU file.
#include "data/calibration/calibration.h"
#include "tests/fuzz/fuzz_target.h"

std::vector<std::string> slcmap::fuzz::Seeds() {
  return CollectFiles(SLCMAP_SOURCE_DIR "/config/rigs");
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  using namespace slcmap;
  const std::string path = fuzz::FileOf("camchain.yaml", bytes, size);
  Warnings warnings;
  fuzz::Refusing([&] { ReadKalibrCalibration(path, path, &warnings); });
  fuzz::Refusing([&] { ReadCalibration(path, &warnings); });
  return 0;
}
