// slcmap simulate, where the program was built without the simulator: says so.
#include "apps/commands/commands.h"
#include "data/core/error.h"

namespace slcmap::inline commands {

void AddSimulateCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("simulate", "(not in this build)");
  command->allow_extras();
  command->callback([] {
    throw ConfigError(
        "simulate: found a build without the simulator, expected one with SLCMAP_BUILD_SIMULATOR");
  });
}

}  // namespace slcmap::commands
