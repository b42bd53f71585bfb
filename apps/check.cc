// slcmap check: what is wrong with a recorded sequence, and what to do about it.
#include "data/check/check.h"

#include <spdlog/spdlog.h>

#include <cstdio>
#include <memory>

#include "apps/commands.h"
#include "apps/progress.h"
#include "apps/sequence_options.h"
#include "data/error.h"

namespace slcmap {
namespace {

struct CheckArguments {
  std::string sequence;
  SequenceOptions options;
  bool json = false;
};

void Check(const CheckArguments& arguments) {
  const Progress progress = StageProgress("check");  // shown or not by the user's level
  // The report names each kind of damage; the readers need not say it too.
  const auto level = spdlog::get_level();
  spdlog::set_level(spdlog::level::err);
  const CheckReport report = CheckSequence(arguments.sequence, arguments.options, progress);
  spdlog::set_level(level);
  std::fputs(arguments.json ? CheckJson(report).c_str() : CheckTable(report).c_str(), stdout);
  if (report.Usable()) return;
  std::fflush(stdout);
  throw DataError(arguments.sequence + ": not usable, see the report");
}

}  // namespace

void AddCheckCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("check", "Check a recorded sequence, naming remedies");
  const auto arguments = std::make_shared<CheckArguments>();
  command
      ->add_option("sequence", arguments->sequence,
                   "EuRoC (ASL) or TUM VI folder: the one with cam0, cam1, imu0, or the one above")
      ->required();
  AddSequenceOptions(*command, &arguments->options);
  command->add_flag("--json", arguments->json, "Print JSON instead of a table");
  command->footer(
      "Examples:\n  slcmap check MH_01_easy\n  slcmap check recording --json > check.json\n\n"
      "Exits with 0 if the sequence can be used, else with 1.");
  command->callback([arguments] { Check(*arguments); });
}

}  // namespace slcmap
