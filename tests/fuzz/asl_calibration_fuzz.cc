// ASL's sensor.yaml, as that of every sensor.
#include "data/calibration/calibration.h"
#include "tests/fuzz/fuzz_target.h"

std::vector<std::string> slcmap::fuzz::Seeds() { return {}; }

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  using namespace slcmap;
  for (const char* sensor : {"cam0", "cam1", "imu0"}) {
    fuzz::FileOf(std::string("mav0/") + sensor + "/sensor.yaml", bytes, size);
  }
  const std::string folder =
      std::filesystem::path(fuzz::FileOf("mav0/input", bytes, 0)).parent_path();
  Warnings warnings;
  fuzz::Refusing([&] { ReadAslCalibration(folder, &warnings); });
  return 0;
}
