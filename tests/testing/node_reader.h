// Programs of npm that read exports back: tests/readers says how they are installed.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/testing/reader_program.h"

namespace slcmap::testing {

// Whether a package of tests/readers/package.json, and node to run it, are installed.
inline bool HasNodeReader(const std::string& package) {
  const std::filesystem::path readers = SLCMAP_SOURCE_DIR "/tests/readers";
  return std::filesystem::exists(readers / "node_modules" / package / "package.json") &&
         HasProgram("node");
}

inline std::string NodeReaderMissing(const std::string& package) {
  return package + " is not installed: npm ci --prefix tests/readers";
}

// What a command writes to its outputs; its exit code.
struct ReaderOutput {
  std::string text;
  int status = -1;
};

inline ReaderOutput RunReader(const std::string& command) {
  ReaderOutput output;
  output.text = OutputOf(command, &output.status);
  return output;
}

// Runs a script of tests/readers on a file.
inline ReaderOutput RunNodeReader(const std::string& script, const std::string& file) {
  return RunReader("node " SLCMAP_SOURCE_DIR "/tests/readers/" + script + " '" + file + "'");
}

}  // namespace slcmap::testing
