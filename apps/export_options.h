// The command-line options of export, which the commands export and run share.
#pragma once

#include <CLI/CLI.hpp>

#include "export/export.h"

namespace slcmap {

// Adds --format, --max-vertices and those of single formats; `options` must outlive the parsing.
void AddExportOptions(CLI::App& command, ExportOptions* options);

}  // namespace slcmap
