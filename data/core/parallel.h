// A loop over independent items on several threads, also one that can be stopped.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <opencv2/core/utility.hpp>
#include <thread>
#include <vector>

#include "data/core/progress.h"

namespace slcmap::inline data {

// Calls work(i) for each i in [begin, end), on up to `threads` threads, in any order: what it
// writes must be of item i alone. Throws what work throws (one of several), once all have ended.
inline void ParallelFor(size_t begin, size_t end, int threads,
                        const std::function<void(size_t)>& work) {
  std::atomic<size_t> next{begin};
  std::exception_ptr error;
  std::mutex error_mutex;
  const auto loop = [&] {
    try {
      for (size_t i = next++; i < end; i = next++) work(i);
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

// The same for each i in [0, count), on as many threads as OpenCV was told of.
inline void ParallelFor(size_t count, const std::function<void(size_t)>& work) {
  ParallelFor(0, count, cv::getNumThreads(), work);
}

// The same, which progress may end: it is asked after each `at_once` of them, in the calling
// thread. Whether all are done.
inline bool ForEachWatched(size_t count, const Progress& progress,
                           const std::function<void(size_t)>& work, size_t at_once = 64) {
  for (size_t begin = 0; begin < count; begin += at_once) {
    if (!progress.Report(static_cast<double>(begin) / static_cast<double>(count))) return false;
    ParallelFor(begin, std::min(count, begin + at_once), cv::getNumThreads(), work);
  }
  return progress.Report(1);
}

}  // namespace slcmap::data
