// Items of a row that are made on other threads while those before them are used.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <future>
#include <opencv2/core/utility.hpp>
#include <utility>

namespace slcmap {

// Gives make(0), make(1), ... up to count - 1, and has begun as many of the next ones as there are
// threads (cv::getNumThreads) when it gives one; with a single thread it makes an item when that is
// asked for. What make() needs must outlive this; it is called from several threads at once.
template <typename Item>
class ReadAhead {
 public:
  ReadAhead(std::size_t count, std::function<Item(std::size_t)> make)
      : count_(count), make_(std::move(make)) {}

  bool is_done() const { return begun_ == count_ && coming_.empty(); }

  // The next item, of which there must be one. Throws what make() throws.
  Item Next() {
    const int threads = cv::getNumThreads();
    const bool is_alone = threads <= 1;
    const std::size_t ahead = is_alone ? 0 : static_cast<std::size_t>(threads);
    for (; begun_ < count_ && coming_.size() <= ahead; ++begun_) {
      coming_.push_back(
          std::async(is_alone ? std::launch::deferred : std::launch::async, make_, begun_));
    }
    std::future<Item> next = std::move(coming_.front());
    coming_.pop_front();
    return next.get();
  }

 private:
  const std::size_t count_;
  const std::function<Item(std::size_t)> make_;
  std::size_t begun_ = 0;
  std::deque<std::future<Item>> coming_;
};

}  // namespace slcmap
