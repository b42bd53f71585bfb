// The command-line options of odometry, which the commands odometry and run share.
#pragma once

#include <CLI/CLI.hpp>

#include "apps/odometry_stage.h"

namespace slcmap {

// Adds SEQ, how it is opened, --method, --config, --write-calibration, --from, --duration,
// --threads, --realtime, --force and --no-check;
// `arguments` must outlive the parsing.
void AddOdometryOptions(CLI::App& command, OdometryArguments* arguments);

}  // namespace slcmap
