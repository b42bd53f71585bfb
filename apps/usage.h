// What the program says of its usage: help, and what is wrong with a command line.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace slcmap {

// The command `help [COMMAND]`. Add it last: it knows the commands that are there.
void AddHelpCommand(CLI::App& app);

// Makes an empty text, as an unset variable of a shell leaves it, an error for every option that
// takes a value.
void RefuseEmptyValues(CLI::App& app);

// Of the option --threads. Throws ConfigError.
void CheckThreads(int threads);

// What was found and what was expected, in one line.
std::string DescribeUsageError(const CLI::App& app, const CLI::ParseError& error);

}  // namespace slcmap
