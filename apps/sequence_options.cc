#include "apps/sequence_options.h"

#include "data/mask.h"

namespace slcmap {
namespace {

CLI::Option* AddMilliseconds(CLI::App& command, const std::string& name, double* value_s,
                             const std::string& words) {
  return command
      .add_option_function<double>(
          name, [value_s](const double& value_ms) { *value_s = 1e-3 * value_ms; }, words)
      ->type_name("MS");
}

}  // namespace

std::vector<CLI::Option*> AddSequenceOptions(CLI::App& command, SequenceOptions* options) {
  return {command.add_option("--calibration", options->calibration,
                             "Kalibr camera chain, or a folder with sensor.yaml files (default: "
                             "the sequence's own)"),
          command
              .add_option("--mask", options->masks,
                          "Image of what moves with the rig, white, a camera: it is left out "
                          "(default: what the check finds; none: nothing)")
              ->delimiter(',')
              ->allow_extra_args(false)
              ->type_name("LEFT,RIGHT"),
          command
              .add_option("--cameras", options->cameras,
                          "Which one or two of a rig's cameras are used (default: the best "
                          "stereo pair)")
              ->delimiter(',')
              ->allow_extra_args(false)
              ->type_name("I,J"),
          AddMilliseconds(command, "--pair-tolerance", &options->max_stereo_offset_s,
                          "Between the stamps of a left and a right image, at most (default: 3)"),
          AddMilliseconds(command, "--right-offset", &options->right_offset_s,
                          "That stamps of the right images are late (default: 0)")};
}

std::vector<std::string> FilesOf(const SequenceOptions& options) {
  std::vector<std::string> files;
  if (!options.calibration.empty()) files.push_back(options.calibration);
  for (const std::string& mask : options.masks) {
    if (mask != kNoMask) files.push_back(mask);
  }
  return files;
}

}  // namespace slcmap
