// A loop over independent items on several threads, also one that can be stopped; and items of a
// row that are made on other threads while those before them are used.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <future>
#include <map>
#include <mutex>
#include <opencv2/core/utility.hpp>
#include <thread>
#include <utility>
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

// As many as there are threads, of a program that has several.
inline size_t ThreadsForReading() {
  const int threads = cv::getNumThreads();
  return threads > 1 ? static_cast<size_t>(threads) : 0;
}

// Gives make(0), make(1), ... up to count - 1, and has begun `ahead` of the next ones when it gives
// one, each on a thread of its own; with 0 it makes an item when that is asked for. What make()
// needs must outlive this; it is called from several threads at once.
template <typename Item>
class ReadAhead {
 public:
  ReadAhead(size_t count, std::function<Item(size_t)> make, size_t ahead = ThreadsForReading())
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
  const size_t count_;
  const std::function<Item(size_t)> make_;
  const size_t ahead_;
  size_t begun_ = 0;
  std::deque<std::future<Item>> coming_;
};

// Items around a place that moves on, such as the images of views around one of them.
template <typename Item>
class ItemsAround {
 public:
  // Of items make(0) to make(count - 1), as of ReadAhead; `reach` to either side are kept.
  ItemsAround(size_t count, std::function<Item(size_t)> make, int reach)
      : reach_(reach), coming_(count, std::move(make)) {}

  // Makes what is needed around an item and forgets the rest; from the first item on, forward.
  void MoveTo(int item) {
    std::erase_if(kept_, [&](const auto& entry) { return entry.first < item - reach_; });
    while (next_ <= item + reach_ && !coming_.is_done()) {
      Item made = coming_.Next();
      if (next_ >= item - reach_) kept_.emplace(next_, std::move(made));
      ++next_;
    }
  }

  const Item& at(int item) const { return kept_.at(item); }
  const std::map<int, Item>& kept() const { return kept_; }

 private:
  const int reach_;
  int next_ = 0;
  ReadAhead<Item> coming_;
  std::map<int, Item> kept_;
};

}  // namespace slcmap::data
