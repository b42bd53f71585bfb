// The JSON files of a run folder, each as every other.
#include "odometry/run/run_folder.h"
#include "odometry/run/run_json.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/testing/made_run.h"

std::vector<std::string> slcmap::fuzz::Seeds() {
  const testing::TempFolder folder;
  WriteRunFolder(folder.Path(), testing::MakeLineRun());
  std::vector<std::string> seeds;
  for (const char* name : {"run.json", "rig.json", "timings.json"}) {
    seeds.push_back(ReadFile(folder.Path(name)));
  }
  return seeds;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  using namespace slcmap;
  const std::string path = fuzz::FileOf("run.json", bytes, size);
  OdometryRun run;
  fuzz::Refusing([&] { ReadRunSummary(path, &run); });
  fuzz::Refusing([&] { ReadRig(path); });
  fuzz::Refusing([&] { ReadTimings(path); });
  return 0;
}
