// A figure that is measured again and again, of which no value is kept.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "odometry/verdict/run_figures.h"

namespace slcmap {

class RunningFigure {
 public:
  // Stamps rise. What is no number is left out: an estimate that diverged is reported as such.
  void Add(int64_t stamp_ns, double value) {
    if (!std::isfinite(value)) return;
    if (block_.count > 0 && stamp_ns - block_start_ns_ >= kBlock_ns) CloseBlock();
    if (block_.count == 0) block_start_ns_ = stamp_ns;
    block_.Add(value);
    all_.Add(value);
  }

  FigureSummary Summary() const {
    const double newest = block_.count >= kMinCount ? block_.Mean() : all_.Mean();
    return {all_.Mean(), std::max(worst_.value_or(newest), newest), all_.count};
  }

 private:
  struct Sum {
    double sum = 0;
    int64_t count = 0;
    void Add(double value) {
      sum += value;
      ++count;
    }
    double Mean() const { return count > 0 ? sum / static_cast<double>(count) : 0; }
  };

  void CloseBlock() {
    if (block_.count >= kMinCount) worst_ = std::max(worst_.value_or(block_.Mean()), block_.Mean());
    block_ = {};
  }

  static constexpr int64_t kBlock_ns = 2'000'000'000;
  static constexpr int64_t kMinCount = 3;  // of a block that counts
  int64_t block_start_ns_ = 0;
  Sum block_, all_;
  std::optional<double> worst_;
};

}  // namespace slcmap
