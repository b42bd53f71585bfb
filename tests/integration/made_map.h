// A run and its map, which the program makes once for a suite: each test has them as they were
// made.
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
    shared_ = new TempFolder;
    kept_ = new TempFolder;
    WriteRunFolder(shared_->Path("run"), MakeWallRun());
    const ProcessResult map =
        RunSlcmap("-q map " + shared_->Path("run") + " -o " + shared_->Path("map"));
    EXPECT_EQ(map.exit_code, 0) << map.error;
    std::filesystem::copy(shared_->Path(), kept_->Path(), kRecursive);
  }
  static void TearDownTestSuite() {
    delete shared_;
    delete kept_;
  }

  // In the same place again: a map knows where its run lies.
  MadeMap() {
    std::filesystem::remove_all(shared_->Path());
    std::filesystem::copy(kept_->Path(), shared_->Path(), kRecursive);
  }

  static constexpr auto kRecursive = std::filesystem::copy_options::recursive;
  inline static TempFolder *shared_ = nullptr, *kept_ = nullptr;
  const TempFolder& folder_ = *shared_;
  const std::string run_ = folder_.Path("run"), map_ = folder_.Path("map");
};

}  // namespace slcmap::testing
