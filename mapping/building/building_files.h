// The building in a map folder: planes.json, rooms.json and plan.json. README.md, "Buildings",
// describes them.
#pragma once

#include <string>
#include <vector>

#include "mapping/building/building.h"

namespace slcmap {

// The names of the files.
std::vector<std::string> BuildingFiles();

// Writes them into a folder that is there. Throws OutputError.
void WriteBuilding(const std::string& folder, const Building& building);

// Reads what WriteBuilding wrote; coordinates come back to a hundredth of a millimetre. Throws
// DataError naming the file and what is wrong in it: a missing key, a value out of its range, an id
// of nothing.
Building ReadBuilding(const std::string& folder);

}  // namespace slcmap
