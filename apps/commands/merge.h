// Merging maps as commands run it.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "mapping/align/align_maps.h"
#include "mapping/options.h"

namespace slcmap::inline commands {

// The option --at, a rough start of the alignment.
CLI::Option* AddStartOption(CLI::App& command, std::string* at);

// Of the text X,Y,Z,YAW_DEG, or with two lengths X,Y,YAW_DEG; none of "". Throws ConfigError, which
// names the option.
std::optional<RoughStart> ParseStart(const std::string& option, size_t lengths,
                                     const std::string& at);

// The options of a merged map: of a file, or without one those that the first map was made with.
MappingOptions OptionsOfMerging(const std::string& config, const std::string& first_map);

}  // namespace slcmap::commands
