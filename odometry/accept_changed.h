// What readers do where the user takes files that are not as they were written.
#pragma once

#include <spdlog/spdlog.h>

#include "data/error.h"
#include "odometry/run.h"

namespace slcmap {

// Calls read(), which fills what a run can do without. Where changes are accepted, what it refuses
// by a DataError is left out, which is said, and counted among the run's warnings.
template <typename Read>
void ReadOrLeaveOut(bool accept_changed, const char* warning, OdometryRun* run, Read read) {
  try {
    read();
  } catch (const DataError& error) {
    if (!accept_changed) throw;
    ++run->warnings[warning];
    spdlog::warn("{}; left out", error.what());
  }
}

}  // namespace slcmap
