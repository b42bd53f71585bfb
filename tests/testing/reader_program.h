// Programs that are not ours and read what we write; tests/install_readers.sh installs them.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <string>

namespace slcmap::testing {

// Whether a shell finds the program.
inline bool HasProgram(const std::string& program) {
  return std::system(("command -v " + program + " >/dev/null 2>&1").c_str()) == 0;
}

// What a command prints, both streams; `status` is 0 where it succeeds.
inline std::string OutputOf(const std::string& command, int* status) {
  std::string output;
  FILE* pipe = popen(("( " + command + " ) 2>&1").c_str(), "r");
  std::array<char, 4096> part;
  while (const std::size_t read = fread(part.data(), 1, part.size(), pipe)) {
    output.append(part.data(), read);
  }
  *status = pclose(pipe);
  return output;
}

// What a command prints that has to succeed.
inline std::string OutputOf(const std::string& command) {
  int status = 0;
  const std::string output = OutputOf(command, &status);
  EXPECT_EQ(status, 0) << command << "\n" << output;
  return output;
}

}  // namespace slcmap::testing

// Skips a test where a program is missing.
#define SLCMAP_NEEDS_READER(program)                                       \
  if (!::slcmap::testing::HasProgram(program)) {                           \
    GTEST_SKIP() << (program) << " is not here: tests/install_readers.sh"; \
  }
