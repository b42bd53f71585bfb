// Tells what kind of folder a user gave, for a message that helps where it is another one.
#pragma once

#include <string>

namespace slcmap {

enum class FolderKind { kSequence, kRun, kMap };

// Throws DataError where the path is no folder, or one that is plainly of another kind: "OUT/map:
// found a map folder, expected a run folder". What a folder of the right kind lacks, its reader
// says.
void ExpectFolder(const std::string& path, FolderKind expected);

}  // namespace slcmap
