// Runs the program as a user does.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>
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

// Runs slcmap with its standard error in $log, and presses Ctrl-C when the shell commands `waiting`
// are done. An end later than a minute after that counts as no end: a second is what it may take,
// the rest is for machines with other work.
inline ProcessResult InterruptAfter(const std::string& waiting, const std::string& arguments) {
  constexpr char kLimit_s[] = "60";
  const TempFolder folder;
  // Without job control a shell makes what runs beside it ignore SIGINT.
  return RunShell("set -m; log='" + folder.Path("log") + "'; \\$SLCMAP " + arguments +
                  " 2>\\$log & pid=\\$!; " + waiting + "; kill -INT \\$pid; " +
                  "start=\\$SECONDS; wait \\$pid; code=\\$?; cat \\$log >&2; " +
                  "[ \\$((SECONDS - start)) -le " + kLimit_s + " ] || code=99; exit \\$code");
}

// Presses Ctrl-C once the program has said `words` on standard error.
inline ProcessResult InterruptSlcmap(const std::string& arguments, const std::string& words) {
  return InterruptAfter(
      "for i in {1..600}; do grep -q '" + words + "' \\$log && break; sleep 0.1; done", arguments);
}

// A rig of small images for the simulator, in Kalibr's form.
inline std::string RigYaml(int scale) {
  std::string text;
  for (const int camera : {0, 1}) {
    text += fmt::format(
        "cam{0}: {{camera_model: pinhole, intrinsics: [{1}, {1}, {2}, {3}],\n"
        "  distortion_model: radtan, distortion_coeffs: [-0.1, 0.01, 0, 0],\n"
        "  resolution: [{4}, {1}], T_imu_cam: [[0, -1, 0, 0], [1, 0, 0, {5}], [0, 0, 1, 0],\n"
        "  [0, 0, 0, 1]]}}\n",
        camera, 60 * scale, 47 * scale - 0.5, 30 * scale - 0.5, 94 * scale,
        camera == 0 ? -0.05 : 0.05);
  }
  return text +
         "imu0: {gyroscope_noise_density: 1.7e-4, gyroscope_random_walk: 2e-5,\n"
         "  accelerometer_noise_density: 2e-3, accelerometer_random_walk: 3e-3, "
         "update_rate: 200}\n";
}

inline int CountRows(const std::string& path) {
  int rows = 0;
  for (const char c : ReadText(path)) rows += c == '\n';
  return rows;
}

// One line, in the form of every error.
inline void ExpectError(const ProcessResult& result, int exit_code, const std::string& part) {
  EXPECT_EQ(result.exit_code, exit_code) << result.error;
  EXPECT_EQ(result.ErrorLines(), 1) << result.error;
  EXPECT_THAT(result.error, ::testing::AllOf(::testing::StartsWith("slcmap: error: "),
                                             ::testing::HasSubstr(part)));
}
inline void ExpectError(const std::string& arguments, int exit_code, const std::string& part) {
  ExpectError(RunSlcmap(arguments), exit_code, part);
}

inline ProcessResult ExpectSuccess(const std::string& arguments) {
  ProcessResult result = RunSlcmap(arguments);
  EXPECT_EQ(result.exit_code, 0) << arguments << "\n" << result.error;
  return result;
}

}  // namespace slcmap::testing
