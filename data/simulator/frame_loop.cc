#include "data/simulator/frame_loop.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <limits>
#include <mutex>
#include <thread>
#include <vector>

#include "data/error.h"
#include "data/progress.h"

namespace slcmap {
namespace {

class FrameLoop {
 public:
  FrameLoop(int count, const std::function<void(int)>& make) : count_(count), make_(make) {}

  int Run(int threads, const std::function<bool(int)>& progress) {
    std::vector<std::thread> workers;
    running_ = threads;
    for (int i = 0; i < threads; ++i) workers.emplace_back([this] { Work(); });
    Watch(progress);
    for (std::thread& worker : workers) worker.join();
    if (error_) std::rethrow_exception(error_);
    return std::min(done_, unmade_);
  }

 private:
  void Work() {
    std::unique_lock lock(mutex_);
    while (!stopped_ && next_ < count_) {
      const int frame = next_++;
      lock.unlock();
      std::exception_ptr error;
      bool made = true;
      try {
        make_(frame);
      } catch (const StoppedError&) {
        made = false;
      } catch (...) {
        error = std::current_exception();
      }
      lock.lock();
      ++done_;
      if (!made) {
        stopped_ = true;
        unmade_ = std::min(unmade_, frame);
      }
      if (error) {
        stopped_ = true;
        error_ = error;
      }
      changed_.notify_one();
    }
    --running_;
    changed_.notify_one();
  }

  void Watch(const std::function<bool(int)>& progress) {
    std::unique_lock lock(mutex_);
    bool over = false;
    int shown = 0;
    while (!over) {
      changed_.wait_for(lock, std::chrono::milliseconds(100),
                        [&] { return running_ == 0 || done_ > shown; });
      over = running_ == 0;
      shown = done_;
      lock.unlock();
      const bool goes_on = progress(shown);
      lock.lock();
      if (!goes_on) stopped_ = true;
    }
  }

  const int count_;
  const std::function<void(int)>& make_;
  std::mutex mutex_;
  std::condition_variable changed_;
  int next_ = 0, done_ = 0, running_ = 0;
  int unmade_ = std::numeric_limits<int>::max();  // the first frame that was stopped
  bool stopped_ = false;
  std::exception_ptr error_;
};

}  // namespace

int MakeFrames(int count, int threads, const std::function<void(int)>& make,
               const std::function<bool(int)>& progress) {
  return FrameLoop(count, make).Run(threads, progress);
}

}  // namespace slcmap
