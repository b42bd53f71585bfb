// Plays a recording at its own pace.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace slcmap {

// How a recording was kept up with.
struct RealTimeReport {
  int64_t skipped_images = 0;                     // because newer ones were due already
  double latency_median_s = 0, latency_95_s = 0;  // from when an image was due until it was done
};

// An image is due when as much time has passed since the first was asked for as between their
// stamps. Where several are due, the newest is next and the others are skipped, but never the
// first.
class RealTimePace {
 public:
  // Of any monotonic clock, in nanoseconds.
  struct Clock {
    std::function<int64_t()> now_ns;
    std::function<void(int64_t)> sleep_until_ns;  // may return early, as on Ctrl-C
  };

  // stamps_ns: of all images, ascending; at least one.
  RealTimePace(std::vector<int64_t> stamps_ns, Clock clock);

  // Whether the next image is due, if there is one.
  bool IsDue() const;

  // Waits until the next image is due, and gives the stamp of the newest one that is. There must be
  // one.
  int64_t Next();

  // The image that is processed: that of Next(), or, where it could not be read, a later one until
  // whose time this waits.
  void Take(int64_t stamp_ns);

  // The image with this stamp is done.
  void Done(int64_t stamp_ns);

  bool AtEnd() const { return next_ == stamps_ns_.size(); }
  RealTimeReport Report() const;

 private:
  int64_t DueAt_ns(int64_t stamp_ns) const;

  std::vector<int64_t> stamps_ns_;
  Clock clock_;
  int64_t start_ns_ = 0;
  size_t next_ = 0;  // index of the first image that was neither taken nor skipped
  int64_t skipped_ = 0;
  std::vector<int64_t> latencies_ns_;
};

// The steady clock, whose sleep looks after at most 50 ms whether it is to end early.
RealTimePace::Clock SteadyClock(std::function<bool()> ends_early);

}  // namespace slcmap
