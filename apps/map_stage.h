// The map stage as commands run it: a run folder in, a map folder out.
#pragma once

#include <string>

#include "data/output_folder.h"
#include "mapping/map.h"
#include "mapping/options.h"

namespace slcmap {

// The options of the section `mapping` of a YAML file; the defaults for "". Throws ConfigError.
MappingOptions ReadMappingOptions(const std::string& config);

// Builds the map of a run folder (also of files that were changed, if asked to), writes and returns
// it, and logs what both hold and what they lack. After Ctrl-C the map is what is done so far, and
// says that it is partial. Throws what reading, mapping and writing throw; an earlier map then
// stays as it was.
MapResult RunMapStage(const std::string& run_folder, const MappingOptions& options,
                      bool accept_changed, OutputFolder* output);

}  // namespace slcmap
