#include "tests/testing/watched_threads.h"

#include <algorithm>
#include <memory>
#include <opencv2/core/parallel/parallel_backend.hpp>

#include "data/core/parallel.h"

namespace slcmap::testing {
namespace {

class WatchedThreads : public cv::parallel::ParallelForAPI {
 public:
  void parallel_for(int tasks, FN_parallel_for_body_cb_t body_callback,
                    void* callback_data) override {
    ParallelFor(0, static_cast<std::size_t>(tasks), count_, [&](std::size_t task) {
      const int start = static_cast<int>(task);
      body_callback(start, start + 1, callback_data);
    });
  }

  int getThreadNum() const override { return 0; }  // nothing here asks
  int getNumThreads() const override { return count_; }
  int setNumThreads(int count) override {
    const int before = count_;
    count_ = std::max(2, count);  // one thread races with none
    return before;
  }
  const char* getName() const override { return "watched threads"; }

 private:
  int count_ = 2;
};

}  // namespace

void RunOnWatchedThreads() {
  cv::parallel::setParallelForBackend(std::make_shared<WatchedThreads>());
}

}  // namespace slcmap::testing
