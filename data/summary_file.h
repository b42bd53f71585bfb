// The JSON summaries of stages' folders: they list the folder's other files with their checksums,
// and hold one of themselves, so that whatever changed since they were written is noticed. Include
// in .cc files only.
#pragma once

#include <string>
#include <vector>

#include "data/json_file.h"

namespace slcmap {

// What messages of files that are not as they were written end in.
inline constexpr char kChangedSince[] =
    "written by another run or changed since; --accept-changed takes it";

// The list of those files in the folder, for a summary's key "files". Throws DataError.
Json ListFiles(const std::string& folder, const std::vector<std::string>& names);

// An id that says what a folder holds: that of the summary with its list of files. The same
// contents have the same id.
std::string IdOf(const Json& summary);

// Writes a summary with the keys "id", which is returned, and "checksum" added. Throws OutputError.
std::string WriteSummaryFile(const std::string& path, Json summary);

// Throws DataError unless the summary and each file that it lists are as they were written.
void CheckFiles(const std::string& folder, const std::string& summary_name, const Json& summary);

// Throws DataError unless the summary itself is as it was written.
void CheckSummary(const std::string& folder, const std::string& summary_name, const Json& summary);

// Throws DataError unless the number of rows that were read is that in the summary's "counts".
void CheckCount(const std::string& folder, const std::string& summary_name, const Json& summary,
                const char* what, std::size_t found);

}  // namespace slcmap
