#include "tests/testing/watched_threads.h"

#include <algorithm>
#include <atomic>
#include <memory>
#include <opencv2/core/parallel/parallel_backend.hpp>
#include <thread>
#include <vector>

namespace slcmap::testing {
namespace {

class WatchedThreads : public cv::parallel::ParallelForAPI {
 public:
  void parallel_for(int tasks, FN_parallel_for_body_cb_t body_callback,
                    void* callback_data) override {
    std::atomic<int> next = 0;
    const auto work = [&](int number) {
      number_ = number;
      for (int task = next++; task < tasks; task = next++) {
        body_callback(task, task + 1, callback_data);
      }
    };
    std::vector<std::thread> others;
    for (int i = 1; i < std::min(count_, tasks); ++i) others.emplace_back(work, i);
    work(0);
    for (std::thread& other : others) other.join();
  }

  int getThreadNum() const override { return number_; }
  int getNumThreads() const override { return count_; }
  int setNumThreads(int count) override {
    const int before = count_;
    count_ = std::max(2, count);  // one thread races with none
    return before;
  }
  const char* getName() const override { return "watched threads"; }

 private:
  static thread_local int number_;
  int count_ = 2;
};

thread_local int WatchedThreads::number_ = 0;

}  // namespace

void RunOnWatchedThreads() {
  cv::parallel::setParallelForBackend(std::make_shared<WatchedThreads>());
}

}  // namespace slcmap::testing
