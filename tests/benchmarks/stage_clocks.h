// CPU time of the stages of a benchmark.
#pragma once

#include <time.h>

#include <cstdio>
#include <map>
#include <string>

namespace slcmap {

// Of the calling thread.
inline double ThreadCpu_s() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// Mean CPU time of each named stage.
class StageClocks {
 public:
  // Gives what f gives.
  template <typename F>
  auto Run(const std::string& name, F f) {
    const Timed timed(&stages_[name]);
    return f();
  }
  double Mean_ms(const std::string& name) const {
    const auto stage = stages_.find(name);
    return stage == stages_.end() ? 0 : 1e3 * stage->second.sum_s / stage->second.calls;
  }
  void Print() const {
    for (const auto& [name, stage] : stages_)
      printf("  %-28s %6.2f ms\n", name.c_str(), Mean_ms(name));
  }

 private:
  struct Stage {
    double sum_s = 0;
    int calls = 0;
  };
  class Timed {
   public:
    explicit Timed(Stage* stage) : stage_(stage) {}
    ~Timed() {
      stage_->sum_s += ThreadCpu_s() - start_s_;
      ++stage_->calls;
    }

   private:
    Stage* stage_;
    double start_s_ = ThreadCpu_s();
  };

  std::map<std::string, Stage> stages_;
};

}  // namespace slcmap
