// How commands that show a map read it.
#pragma once

#include <spdlog/spdlog.h>

#include <string>

#include "data/error.h"
#include "mapping/map.h"

namespace slcmap {

// Counts runs and maps that were taken although their files were changed since, or they are not of
// the run beside them, as a warning.
inline constexpr const char* kChangedFilesAccepted = "changed_files_accepted";

// Calls and returns read(false), which refuses what was changed; where it is accepted all the same,
// read(true), which counts that among its warnings.
template <typename Read>
auto ReadAccepting(bool accept_changed, Read read) {
  try {
    return read(false);
  } catch (const DataError& error) {
    if (!accept_changed) throw;
    auto accepted = read(true);
    ++accepted.warnings[kChangedFilesAccepted];
    spdlog::warn("{}; accepted all the same", error.what());
    return accepted;
  }
}

// Reads a map folder, and warns where the map is partial; Ctrl-C ends the program meanwhile. Unless
// accept_changed, throws DataError for files that are not as `map` wrote them, and for a map of
// another run than that beside it.
MapResult ReadMapToShow(const std::string& folder, bool accept_changed);

}  // namespace slcmap
