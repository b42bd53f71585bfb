// Items of a row that are made on other threads while those before them are used.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <future>
#include <opencv2/core/utility.hpp>
#include <utility>

#include "data/core/parallel.h"

namespace slcmap::inline mapping {

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

}  // namespace slcmap::mapping
