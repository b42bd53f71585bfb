// slcmap odometry: the motion of a rig from a recorded sequence.
#include <memory>

#include "apps/commands/check.h"
#include "apps/commands/commands.h"
#include "apps/commands/odometry_stage.h"
#include "apps/commands/options.h"

namespace slcmap::inline commands {

void AddOdometryCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("odometry", "Estimate the motion of a recorded rig");
  const auto arguments = std::make_shared<OdometryArguments>();
  AddOdometryOptions(*command, arguments.get());
  command->add_option("-o,--output", arguments->run, "Run folder to write")->required();
  command->footer(
      "Examples:\n  slcmap odometry MH_01_easy -o run\n"
      "  slcmap odometry dataset-room1_512_16 -o run --method points --config tuning.yaml\n\n"
      "Writes trajectory.tum (pose of the IMU body, a row an image), points.ply, lines.ply,\n"
      "timings.json and what map reads. Ctrl-C ends with the results so far.\n\n" +
      std::string(kVerdictHelp));
  command->callback([arguments] { RefuseFailed(arguments->run, RunOdometryStage(*arguments)); });
}

}  // namespace slcmap::commands
