// Loops over independent items on several threads, also ones that can be stopped, and items of a
// row that are made on other threads while those before them are used.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <future>
#include <mutex>
#include <opencv2/core/utility.hpp>
#include <thread>
#include <utility>
#include <vector>

#include "data/core/progress.h"

namespace slcmap::inline mapping {

// Calls work(i) for each i in [0, count): what it writes must be of item i alone. Whether all are
// done, which they are not once progress says so; it is asked after each `at_once` of them.
template <typename Work>
bool ForEachWatched(size_t count, const Progress& progress, Work work, size_t at_once = 64) {
  for (size_t begin = 0; begin < count; begin += at_once) {
    if (!progress.Report(static_cast<double>(begin) / static_cast<double>(count))) return false;
    const size_t end = std::min(count, begin + at_once);
    cv::parallel_for_({static_cast<int>(begin), static_cast<int>(end)},
                      [&](const cv::Range& range) {
                        for (int i = range.start; i < range.end; ++i) work(static_cast<size_t>(i));
                      });
  }
  return progress.Report(1);
}

// Items of a row that are made on other threads while those before them are used.

// As many as there are threads, of a program that has several.
inline std::size_t ThreadsForReading() {
  const int threads = cv::getNumThreads();
  return threads > 1 ? static_cast<std::size_t>(threads) : 0;
}

// Gives make(0), make(1), ... up to count - 1, and has begun `ahead` of the next ones when it gives
// one, each on a thread of its own; with 0 it makes an item when that is asked for. What make()
// needs must outlive this; it is called from several threads at once.
template <typename Item>
class ReadAhead {
 public:
  ReadAhead(std::size_t count, std::function<Item(std::size_t)> make,
            std::size_t ahead = ThreadsForReading())
      : count_(count), make_(std::move(make)), ahead_(ahead) {}

  bool is_done() const { return begun_ == count_ && coming_.empty(); }

  // The next item, of which there must be one. Throws what make() throws.
  Item Next() {
    const std::launch policy = ahead_ == 0 ? std::launch::deferred : std::launch::async;
    for (; begun_ < count_ && coming_.size() <= ahead_; ++begun_) {
      coming_.push_back(std::async(policy, make_, begun_));
    }
    std::future<Item> next = std::move(coming_.front());
    coming_.pop_front();
    return next.get();
  }

 private:
  const std::size_t count_;
  const std::function<Item(std::size_t)> make_;
  const std::size_t ahead_;
  std::size_t begun_ = 0;
  std::deque<std::future<Item>> coming_;
};

// Calls work(i) for each i in [begin, end), on up to `threads` threads, in any order: what it
// writes must be of item i alone. Throws what work throws (one of several), once all have ended.
inline void ParallelFor(std::size_t begin, std::size_t end, int threads,
                        const std::function<void(std::size_t)>& work) {
  std::atomic<std::size_t> next{begin};
  std::exception_ptr error;
  std::mutex error_mutex;
  const auto loop = [&] {
    try {
      for (std::size_t i = next++; i < end; i = next++) work(i);
    } catch (...) {
      const std::lock_guard lock(error_mutex);
      error = std::current_exception();
      next = end;
    }
  };
  std::vector<std::thread> others;
  for (int i = 1; i < threads && begin + i < end; ++i) others.emplace_back(loop);
  loop();
  for (std::thread& other : others) other.join();
  if (error) std::rethrow_exception(error);
}

}  // namespace slcmap::mapping
