// A run and its map, which the program makes once: each test has them as they were made.
#pragma once

#include <filesystem>
#include <string>

#include "odometry/run/run_folder.h"
#include "tests/integration/slcmap_process.h"
#include "tests/testing/made_run.h"

namespace slcmap::testing {

class MadeMap : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (!std::filesystem::is_empty(kept_.Path())) return;  // that of another suite
    WriteRunFolder(folder_.Path("run"), MakeWallRun());
    ExpectSuccess("-q map " + folder_.Path("run") + " -o " + folder_.Path("map"));
    std::filesystem::copy(folder_.Path(), kept_.Path(), kRecursive);
  }

  // In the same place again: a map knows where its run lies.
  MadeMap() {
    std::filesystem::remove_all(folder_.Path());
    std::filesystem::copy(kept_.Path(), folder_.Path(), kRecursive);
  }

  static constexpr auto kRecursive = std::filesystem::copy_options::recursive;
  inline static const TempFolder folder_, kept_;
  const std::string run_ = folder_.Path("run"), map_ = folder_.Path("map");
};

}  // namespace slcmap::testing
