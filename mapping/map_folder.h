// A map on disk, as documented files that other programs can read too. README.md, "Map folder",
// describes each file.
#pragma once

#include <string>

#include "mapping/map.h"

namespace slcmap {

// Writes a map into a folder, which is made where it is missing; files of an earlier map are
// replaced. Throws OutputError, naming the file, when something cannot be written.
void WriteMapFolder(const std::string& folder, const MapResult& map);

// Reads what WriteMapFolder wrote; points come back rounded to float, without landmark ids. Throws
// DataError, naming file and row, when a file is missing, damaged or of another version.
MapResult ReadMapFolder(const std::string& folder);

}  // namespace slcmap
