// Verdicts in the summaries of stages' folders. Include in .cc files only.
#pragma once

#include <optional>
#include <string>

#include "data/json_file.h"
#include "data/verdict.h"

namespace slcmap {

// {level, reasons: [{level, what, found, expected, remedy}]}; null of a run that was not judged.
Json VerdictJson(const std::optional<Verdict>& verdict);

// The key "verdict" of a summary, which may lack it. Throws DataError naming `path`.
std::optional<Verdict> ParseVerdict(const std::string& path, const Json& summary);

}  // namespace slcmap
