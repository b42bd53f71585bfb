// How commands that show a map read it.
#pragma once

#include <string>

#include "mapping/map.h"

namespace slcmap {

// Counts runs and maps that were taken although their files were changed since, or they are not of
// the run beside them, as a warning.
inline constexpr const char* kChangedFilesAccepted = "changed_files_accepted";

// Reads a map folder, and warns where the map is partial; Ctrl-C ends the program meanwhile. Unless
// accept_changed, throws DataError for files that are not as `map` wrote them, and for a map of
// another run than that beside it.
MapResult ReadMapToShow(const std::string& folder, bool accept_changed);

}  // namespace slcmap
