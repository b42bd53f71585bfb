// Shows how far a long command has come: a bar on a terminal, a line every tenth otherwise.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace slcmap {

class Progress {
 public:
  // `total` steps; nothing is shown below the log level "info" (--quiet).
  Progress(std::string label, int64_t total);
  ~Progress();  // leaves the line of the bar

  // `done` steps so far, which cover data_s of the recording and distance_m of its path.
  void Update(int64_t done, double data_s, double distance_m);

 private:
  void ShowBar(double share, const std::string& figures);

  const std::string label_;
  const int64_t total_;
  const bool shown_, on_terminal_;
  const std::chrono::steady_clock::time_point start_;
  std::chrono::steady_clock::time_point last_shown_;
  int next_tenth_ = 1;
  bool bar_shown_ = false;
};

}  // namespace slcmap
