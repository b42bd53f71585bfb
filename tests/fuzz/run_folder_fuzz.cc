// A run folder, one of whose files is another.
#include "odometry/run/run_folder.h"
#include "tests/fuzz/folder_target.h"
#include "tests/testing/made_run.h"

namespace {

const slcmap::fuzz::FolderTarget& Target() {
  static const slcmap::fuzz::FolderTarget target([](const std::string& folder) {
    slcmap::OdometryRun run = slcmap::testing::MakeLineRun();
    run.source = slcmap::testing::MakeSource(run);
    slcmap::WriteRunFolder(folder, run);
  });
  return target;
}

}  // namespace

std::vector<std::string> slcmap::fuzz::Seeds() { return Target().Seeds(); }

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  Target().Run(bytes, size, [](const std::string& folder) { slcmap::ReadRunFolder(folder); });
  return 0;
}
