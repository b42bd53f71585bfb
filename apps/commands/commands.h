// The subcommands of slcmap, one a file, and what the program says of its usage. Each adds itself
// to the program with its options and a callback that does the work; errors are thrown and turned
// into one line and an exit code by main().
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "data/core/error.h"

namespace slcmap::inline commands {

void AddSimulateCommand(CLI::App& app);
void AddCheckCommand(CLI::App& app);
void AddConvertCommand(CLI::App& app);
void AddCalibrationCommand(CLI::App& app);
void AddOdometryCommand(CLI::App& app);
void AddMapCommand(CLI::App& app);
void AddMergeCommand(CLI::App& app);
void AddRegisterCommand(CLI::App& app);
void AddGeoreferenceCommand(CLI::App& app);
void AddExportCommand(CLI::App& app);
void AddViewCommand(CLI::App& app);
void AddRunCommand(CLI::App& app);
void AddEvaluateCommand(CLI::App& app);
void AddCompareCommand(CLI::App& app);
void AddBatchCommand(CLI::App& app);

// All of them, in the order in which data flows, and `help`; one of them is required.
void AddCommands(CLI::App& app);

// A job of the site in a folder, as `batch --job` starts it: does it, unless its result is there,
// and leaves its result, also where it fails: that is no error, so that others go on. Waits while
// another process does the same job. Throws StoppedError after Ctrl-C, OutputError where the result
// cannot be written, and DataError where the site has no such job.
void RunSiteJob(const std::string& folder, const std::string& name, int threads);

// Exit codes of slcmap.
inline constexpr int kExitSuccess = 0;
inline constexpr int kExitFailure = 1;  // bad data, or output that could not be written
inline constexpr int kExitUsage = 2;    // wrong command line or configuration
inline constexpr int kExitInterrupted = 130;

// From now on the first Ctrl-C asks the program to end with the results so far; the next one kills
// it. A file that becomes too large is an error of writing.
void HandleInterruptions();

// True once the user pressed Ctrl-C; long loops look at it and end with the results so far.
bool Interrupted();

// What Ctrl-C does, for those who catch it themselves, from any thread; and undone, before another
// command.
void Interrupt();
void ForgetInterruption();

// While it lives Ctrl-C ends the program at once, as nothing is written that could be lost: for
// reading and computing before the first output. One at a time. Throws StoppedError where Ctrl-C
// was pressed before.
class EndsAtOnce {
 public:
  EndsAtOnce();
  ~EndsAtOnce();
  EndsAtOnce(const EndsAtOnce&) = delete;
  EndsAtOnce& operator=(const EndsAtOnce&) = delete;
};

// What the program says of its usage: help, and what is wrong with a command line.

// The command `help [COMMAND]`. Add it last: it knows the commands that are there.
void AddHelpCommand(CLI::App& app);

// Makes an empty text, as an unset variable of a shell leaves it, an error for every option that
// takes a value.
void RefuseEmptyValues(CLI::App& app);

// Whether something is at a path; false where it cannot be told.
bool Exists(const std::string& path);

// Counts by kind, for commands that end with them.
void LogWarnings(const Warnings& warnings);

// Of the option --threads. Throws ConfigError.
void CheckThreads(int threads);

// What was found and what was expected, in one line.
std::string DescribeUsageError(const CLI::App& app, const CLI::ParseError& error);

// Tells what kind of folder a user gave, for a message that helps where it is another one.

enum class FolderKind { kSequence, kRun, kMap };

// Throws DataError where the path is no folder, or one that is plainly of another kind: "OUT/map:
// found a map folder, expected a run folder". A bag is a sequence, too. What one of the right kind
// lacks, its reader says.
void ExpectFolder(const std::string& path, FolderKind expected);

}  // namespace slcmap::commands
