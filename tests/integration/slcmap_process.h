// Runs the program as a user does.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <csignal>
#include <cstdlib>
#include <string>

#include "tests/testing/temp_folder.h"

namespace slcmap::testing {

struct ProcessResult {
  int exit_code = 0;
  std::string output;  // standard output
  std::string error;   // standard error

  int ErrorLines() const {
    int lines = 0;
    for (const char c : error) lines += c == '\n';
    return lines;
  }
};

// Runs a shell command in which $SLCMAP is the program.
inline ProcessResult RunShell(const std::string& command) {
  std::signal(SIGINT, SIG_DFL);  // that of the tests may be ignored, which is inherited
  const TempFolder folder;
  const std::string line = "SLCMAP='" SLCMAP_PROGRAM "'; ( " + command + " ) >'" +
                           folder.Path("out") + "' 2>'" + folder.Path("err") + "'";
  const int status = std::system(("bash -c \"" + line + "\"").c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, ReadText(folder.Path("out")),
          ReadText(folder.Path("err"))};
}

inline ProcessResult RunSlcmap(const std::string& arguments) {
  return RunShell("\\$SLCMAP " + arguments);
}

// Presses Ctrl-C once the program has said `words` on standard error. An end later than 20 s after
// that counts as no end.
inline ProcessResult InterruptSlcmap(const std::string& arguments, const std::string& words) {
  const TempFolder folder;
  const std::string log = folder.Path("log");
  // Without job control a shell makes what runs beside it ignore SIGINT.
  return RunShell("set -m; \\$SLCMAP " + arguments + " 2>" + log +
                  " & pid=\\$!; for i in {1..600}; do grep -q '" + words + "' " + log +
                  " && break; sleep 0.1; done; kill -INT \\$pid; " +
                  "start=\\$SECONDS; wait \\$pid; code=\\$?; cat " + log + " >&2; " +
                  "[ \\$((SECONDS - start)) -lt 20 ] || code=99; exit \\$code");
}

// One line, in the form of every error.
inline void ExpectError(const ProcessResult& result, int exit_code, const std::string& part) {
  EXPECT_EQ(result.exit_code, exit_code) << result.error;
  EXPECT_EQ(result.ErrorLines(), 1) << result.error;
  EXPECT_THAT(result.error, ::testing::AllOf(::testing::StartsWith("slcmap: error: "),
                                             ::testing::HasSubstr(part)));
}

}  // namespace slcmap::testing
