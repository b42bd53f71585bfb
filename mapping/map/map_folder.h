// A map on disk, as documented files that other programs can read too. mapping/FORMAT.md
// describes each file.
#pragma once

#include <string>

#include "data/io/output_folder.h"
#include "mapping/map/map.h"
#include "odometry/run/run_folder.h"

namespace slcmap::inline mapping {

// The names of the files of a map.
StageFiles MapFiles();

// Writes a map into a folder, which is made where it is missing; the files of an earlier map are
// replaced once all are written, or moved aside (see OutputFolder::Commit). Throws OutputError,
// naming the file, when something cannot be written, and what OutputFolder throws. Returns the id
// that the map has there.
std::string WriteMapFolder(const std::string& folder, const MapResult& map);
std::string WriteMapFolder(OutputFolder* folder, const MapResult& map);

// Reads what WriteMapFolder wrote; points come back rounded to float, without landmark ids. Throws
// DataError, naming file and row, what was found and what was expected, when a file is missing,
// damaged, changed or of another version.
MapResult ReadMapFolder(const std::string& folder, const FolderReadOptions& options = {});

// Where the map in a folder came from, by its summary alone. Throws DataError.
MapSource MapSourceIn(const std::string& folder);

}  // namespace slcmap::mapping
