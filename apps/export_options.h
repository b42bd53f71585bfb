// The command-line options of export, which the commands export and run share.
#pragma once

#include <CLI/CLI.hpp>

#include "export/export.h"

namespace slcmap {

// Adds --format, --max-vertices, --plan-scale and --wall-sigma; `options` must outlive the parsing.
void AddExportOptions(CLI::App& command, ExportOptions* options);

}  // namespace slcmap
