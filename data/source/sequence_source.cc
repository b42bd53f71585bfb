#include "data/source/sequence_source.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>
#include <utility>

namespace slcmap::inline data {
namespace {

constexpr int64_t kLongestSleep_ns = 50'000'000;

int64_t SteadyNow_ns() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

// The smallest value that this share of all does not exceed; 0 where there are none.
double Quantile_s(std::vector<int64_t> values_ns, double share) {
  if (values_ns.empty()) return 0;
  const double rank = std::ceil(share * static_cast<double>(values_ns.size()));
  const auto at =
      values_ns.begin() + std::max<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(rank), 1) - 1;
  std::nth_element(values_ns.begin(), at, values_ns.end());
  return 1e-9 * static_cast<double>(*at);
}

}  // namespace

RealTimePace::RealTimePace(std::vector<int64_t> stamps_ns, Clock clock)
    : stamps_ns_(std::move(stamps_ns)), clock_(std::move(clock)) {}

int64_t RealTimePace::DueAt_ns(int64_t stamp_ns) const {
  return start_ns_ + stamp_ns - stamps_ns_.front();
}

bool RealTimePace::IsDue() const {
  return !AtEnd() && (next_ == 0 || DueAt_ns(stamps_ns_[next_]) <= clock_.now_ns());
}

int64_t RealTimePace::Next() {
  if (next_ == 0) {
    start_ns_ = clock_.now_ns();
    return stamps_ns_.front();
  }
  clock_.sleep_until_ns(DueAt_ns(stamps_ns_[next_]));
  const int64_t now_ns = clock_.now_ns();
  size_t newest = next_;
  while (newest + 1 < stamps_ns_.size() && DueAt_ns(stamps_ns_[newest + 1]) <= now_ns) ++newest;
  skipped_ += static_cast<int64_t>(newest - next_);
  next_ = newest;
  return stamps_ns_[newest];
}

void RealTimePace::Take(int64_t stamp_ns) {
  clock_.sleep_until_ns(DueAt_ns(stamp_ns));
  const auto after = std::upper_bound(stamps_ns_.begin(), stamps_ns_.end(), stamp_ns);
  next_ = static_cast<size_t>(after - stamps_ns_.begin());
}

void RealTimePace::Done(int64_t stamp_ns) {
  latencies_ns_.push_back(clock_.now_ns() - DueAt_ns(stamp_ns));
}

RealTimeReport RealTimePace::Report() const {
  return {skipped_, Quantile_s(latencies_ns_, 0.5), Quantile_s(latencies_ns_, 0.95)};
}

RealTimePace::Clock SteadyClock(std::function<bool()> ends_early) {
  const auto sleep_until_ns = [ends_early = std::move(ends_early)](int64_t until_ns) {
    for (int64_t now_ns = SteadyNow_ns(); now_ns < until_ns && !ends_early();
         now_ns = SteadyNow_ns()) {
      const int64_t part_ns = std::min(until_ns - now_ns, kLongestSleep_ns);
      std::this_thread::sleep_for(std::chrono::nanoseconds(part_ns));
    }
  };
  return {SteadyNow_ns, sleep_until_ns};
}

}  // namespace slcmap::data
