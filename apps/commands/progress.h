// Shows how far a long command has come, on standard error, and measures what it cost.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>

#include "data/core/progress.h"

namespace slcmap::inline commands {

// A bar on a terminal; elsewhere a line every tenth, or where it takes long. Nothing is shown below
// the log level "info" (--quiet).
class ProgressBar {
 public:
  enum class Elsewhere { kTenths, kSeldom };

  explicit ProgressBar(std::string label, Elsewhere elsewhere = Elsewhere::kTenths);
  ~ProgressBar();  // leaves the bar
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  // `share` of all is done, in [0, 1]; figures(elapsed_s), which is called where they are shown,
  // says more.
  void Update(double share, const std::function<std::string(double)>& figures = {});

  // Of a command that goes through a recording: `done` of so many images, which cover data_s of it
  // and distance_m of its path.
  void Update(int64_t done, int64_t images, double data_s, double distance_m);

  // Ends the line of the bar; the next look begins another.
  void Leave();

 private:
  bool IsDue(double share) const;
  void ShowBar(double share, const std::string& text);

  const std::string label_;
  const bool on_terminal_, shown_;
  const Elsewhere elsewhere_;
  const std::chrono::steady_clock::time_point start_;
  std::chrono::steady_clock::time_point last_shown_;
  int next_tenth_ = 1;
  bool bar_shown_ = false;
};

// Who is told by all bars how far they are, in [0, 1], instead of the terminal: in any thread, and
// often. Set it while no command runs; {} for nobody.
using ProgressListener = std::function<void(const std::string& label, double share)>;
void SetProgressListener(ProgressListener listener);

// For a stage of a library: shows a bar on a terminal, elsewhere a line now and then, and ends the
// stage after Ctrl-C, which it says.
Progress StageProgress(const std::string& label);

// What this process has cost so far.

struct ProcessCost {
  double cpu_s = 0;   // user + system, all threads
  double wall_s = 0;  // on a clock of its own zero
  double peak_memory_mib = 0;
};

ProcessCost CostSoFar();

}  // namespace slcmap::commands
