// Wall time by stage of a program.
#pragma once

#include <chrono>
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

  const std::vector<StageTiming>& Stages() const { return stages_; }

 private:
  size_t Index(const std::string& name) {
    for (size_t i = 0; i < stages_.size(); ++i) {
      if (stages_[i].name == name) return i;
    }
    StageTiming stage;
    stage.name = name;
    stages_.push_back(stage);
    return stages_.size() - 1;
  }

  std::vector<StageTiming> stages_;
};

}  // namespace slcmap
