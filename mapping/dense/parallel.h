// A loop over independent items on several threads.
#pragma once

#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace slcmap {

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

}  // namespace slcmap
