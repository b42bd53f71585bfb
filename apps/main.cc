// slcmap: maps buildings from the images of a stereo camera and the samples of an IMU.
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <new>
#include <opencv2/core.hpp>
#include <thread>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "apps/commands/commands.h"
#include "apps/commands/odometry_stage.h"
#include "data/core/error.h"
#include "data/core/progress.h"
#include "data/version.h"

namespace slcmap::inline commands {
namespace {

int PrintError(std::string message, int exit_code) {
  while (!message.empty() && message.back() == '\n') message.pop_back();
  for (char& c : message) {
    if (c == '\n') c = ' ';
  }
  std::fprintf(stderr, "slcmap: error: %s\n", message.c_str());
  return exit_code;
}

// Before and behind the command, as users expect it.
void AddLogFlags(CLI::App& app) {
  app.add_flag_callback(
      "-v,--verbose", [] { spdlog::set_level(spdlog::level::debug); }, "Say more");
  app.add_flag_callback(
      "-q,--quiet", [] { spdlog::set_level(spdlog::level::warn); },
      "Print warnings and errors only");
}

void SetUpLog() {
  spdlog::set_default_logger(spdlog::stderr_color_mt("slcmap"));
  // On a terminal a message takes the line of a progress bar, which is drawn again below it.
  const std::string clear_line = isatty(STDERR_FILENO) != 0 ? "\r\x1b[K" : "";
  spdlog::set_pattern(clear_line + "slcmap: %^%l%$: %v");
}

int RunProgram(int argc, char** argv) {
  CLI::App app;
  app.set_version_flag("--version", kVersion);
  SetUpLog();
  AddCommands(app);
  app.footer(
      "Exit codes: 0 done, 1 bad data or output, 2 wrong usage, 3 a run that failed by its own\n"
      "verdict (all is written), 130 interrupted.");
  AddLogFlags(app);
  for (CLI::App* command : app.get_subcommands([](CLI::App*) { return true; })) {
    AddLogFlags(*command);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) return PrintError(DescribeUsageError(app, error), kExitUsage);
    app.exit(error);  // --help, --version
  }
  std::cout.flush();
  if (!std::cout || std::fflush(stdout) != 0)
    throw OutputError("standard output: cannot be written");
  return Interrupted() ? kExitInterrupted : kExitSuccess;
}

// glibc has eight stores of memory for each processor, and what a thread frees stays in its own: a
// quarter more in all for a map, which has many short threads.
void ShareMemoryAmongThreads() {
#ifdef __GLIBC__
  if (std::getenv("MALLOC_ARENA_MAX") != nullptr) return;
  mallopt(M_ARENA_MAX, static_cast<int>(std::max(2U, std::thread::hardware_concurrency())));
#endif
}

}  // namespace
}  // namespace slcmap::commands

int main(int argc, char** argv) {
  using namespace slcmap;
  ShareMemoryAmongThreads();
  HandleInterruptions();
  try {
    return RunProgram(argc, argv);
  } catch (const ConfigError& error) {
    return PrintError(error.what(), kExitUsage);
  } catch (const StoppedError& error) {
    return PrintError(error.what(), kExitInterrupted);
  } catch (const FailedRunError& error) {
    return PrintError(error.what(), kExitFailedRun);
  } catch (const InputFault& error) {
    return PrintError(error.what() + ("; remedy: " + error.remedy()), kExitFailure);
  } catch (const cv::Exception& error) {
    return PrintError("images that could not be worked on (" + error.func + ": " + error.err +
                          "); let slcmap check say what is wrong with them",
                      kExitFailure);
  } catch (const std::bad_alloc&) {
    return PrintError("out of memory", kExitFailure);
  } catch (const std::exception& error) {
    return PrintError(error.what(), kExitFailure);
  }
}
