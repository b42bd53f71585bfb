// Command-line options that commands share: how a recording is opened, how others write poses,
// those of odometry, and maps by other systems.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "apps/commands/odometry_stage.h"
#include "apps/maps/measured_map.h"
#include "data/io/trajectory.h"
#include "data/source/sequence.h"

namespace slcmap::inline commands {

// Adds --calibration, --mask, --cameras, --topics, --pair-tolerance and --right-offset; `options`
// must outlive the parsing. Returns what was added.
std::vector<CLI::Option*> AddSequenceOptions(CLI::App& command, SequenceOptions* options);

// Those that differ from the defaults, as arguments of a command.
std::vector<std::string> SequenceArguments(const SequenceOptions& options);

// The files that these options name.
std::vector<std::string> CollectFiles(const SequenceOptions& options);

// The command-line options of the form in which others write poses, which map, evaluate and compare
// share.

// `form` must outlive the parsing. Returns what was added.
std::vector<CLI::Option*> AddPoseOptions(CLI::App& command, PoseForm* form);

// The command-line options of odometry, which the commands odometry and run share.

// Adds SEQ, how it is opened, --method, --config, --write-calibration, --from, --duration,
// --threads, --realtime, --force and --no-check;
// `arguments` must outlive the parsing.
void AddOdometryOptions(CLI::App& command, OdometryArguments* arguments);

// Maps by other systems on the command line: which evaluate and compare measure.

struct ExternalMapArguments {
  std::vector<std::string> maps;  // NAME=PATH, or PATH
  std::string truth;
  double true_scale = 1;
  std::vector<std::string> scales;  // NAME=S
  bool as_they_are = false;
};

// Adds --maps, --true-map, --as-they-are, --map-scale and --true-scale; `arguments` must outlive
// the parsing. Returns --maps.
CLI::Option* AddExternalMapOptions(CLI::App& command, ExternalMapArguments* arguments);

// What these name. Throws ConfigError.
MapsToMeasure CollectMaps(const ExternalMapArguments& arguments);

// The files and folders that are read.
std::vector<std::string> CollectFiles(const MapsToMeasure& maps);

}  // namespace slcmap::commands
