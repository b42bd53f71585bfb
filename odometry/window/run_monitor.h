// What a run knows about itself while it goes on: figures that are measured again and again, of
// which no value is kept, and wall time by stage.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "odometry/run/run.h"
#include "odometry/window/options.h"
#include "odometry/window/problem.h"

namespace slcmap::inline odometry {

// Why a state cannot be true; empty where it can.
std::string FindImpossible(const OnlineState& state, const FailureOptions& limits);

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

// Gathers what a run knows about itself while it goes on.

class FigureCollector {
 public:
  void AddImage(int64_t stamp_ns, const FrameFit& fit);
  void AddKeyframe(int64_t stamp_ns, const WindowFit& fit);
  RunFigures Figures() const;

 private:
  RunningFigure points_rejected_, observations_rejected_, reprojection_chi2_, imu_chi2_, blind_;
  bool sees_ = false;  // an image has shown points
  RunningFigure turn_rate_rad_s_, acceleration_m_s2_, seen_right_;
};

// Wall time by stage of a program. Stages may run at the same time, in several threads.

class StageClock {
 public:
  // Adds the time until its end to a stage.
  class Timed {
   public:
    Timed(StageClock* clock, size_t stage)
        : clock_(clock), stage_(stage), start_(std::chrono::steady_clock::now()) {}
    ~Timed() {
      const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start_;
      const std::lock_guard lock(clock_->mutex_);
      clock_->stages_[stage_].wall_s += spent.count();
      ++clock_->stages_[stage_].calls;
    }
    Timed(const Timed&) = delete;
    Timed& operator=(const Timed&) = delete;

   private:
    StageClock* clock_;
    size_t stage_;
    std::chrono::steady_clock::time_point start_;
  };

  // Keep the result until the stage ends.
  [[nodiscard]] Timed Time(const std::string& name) { return {this, Index(name)}; }

  // Of the stages that have ended so far.
  std::vector<StageTiming> Stages() const {
    const std::lock_guard lock(mutex_);
    return stages_;
  }

 private:
  size_t Index(const std::string& name) {
    const std::lock_guard lock(mutex_);
    for (size_t i = 0; i < stages_.size(); ++i) {
      if (stages_[i].name == name) return i;
    }
    StageTiming stage;
    stage.name = name;
    stages_.push_back(stage);
    return stages_.size() - 1;
  }

  mutable std::mutex mutex_;  // guards stages_
  std::vector<StageTiming> stages_;
};

}  // namespace slcmap::odometry
