// The command-line options of how a recording is opened, which all commands that open one share.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "data/sequence.h"

namespace slcmap {

// Adds --calibration, --mask, --cameras, --pair-tolerance and --right-offset; `options` must
// outlive the parsing. Returns what was added.
std::vector<CLI::Option*> AddSequenceOptions(CLI::App& command, SequenceOptions* options);

// The files that these options name.
std::vector<std::string> FilesOf(const SequenceOptions& options);

}  // namespace slcmap
