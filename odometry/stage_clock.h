// Wall time by stage of a program. Stages may run at the same time, in several threads.
#pragma once

#include <chrono>
#include <mutex>
#include <string>
#include <vector>

#include "odometry/run.h"

namespace slcmap {

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

}  // namespace slcmap
