#include "apps/sequence_options.h"

namespace slcmap {

std::vector<CLI::Option*> AddSequenceOptions(CLI::App& command, SequenceOptions* options) {
  return {command.add_option("--calibration", options->calibration,
                             "Kalibr camera chain, or a folder with sensor.yaml files (default: "
                             "the sequence's own)")};
}

std::vector<std::string> FilesOf(const SequenceOptions& options) {
  std::vector<std::string> files;
  if (!options.calibration.empty()) files.push_back(options.calibration);
  return files;
}

}  // namespace slcmap
