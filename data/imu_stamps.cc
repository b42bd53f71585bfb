#include "data/imu_stamps.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace slcmap {
namespace {

constexpr double kTinyStep = 0.3;       // of the sensor's period: within a packet
constexpr double kLongStep = 1.6;       // around one
constexpr double kMinTinyShare = 0.1;   // of steps that are tiny, where packets are believed
constexpr double kArrivalShare = 0.75;  // of the samples that are in packets, where all arrive so
constexpr double kMaxPacket_s = 0.15;

struct Packet {
  size_t first = 0, last = 0;  // samples
  size_t size() const { return last - first + 1; }
};

class PacketStamps {
 public:
  explicit PacketStamps(const std::vector<int64_t>& stamps_ns)
      : stamps_ns_(stamps_ns), period_ns_(SamplingPeriod(stamps_ns)) {
    for (size_t i = 0; i < stamps_ns.size(); ++i) {
      if (i > 0 && Step(i - 1, i) < kTinyStep * period_ns_) {
        packets_.back().last = i;
      } else {
        packets_.push_back({i, i});
      }
    }
  }

  // The samples of packets that stand for the time around them.
  size_t Packed() const {
    size_t packed = 0;
    for (size_t p = 0; p < packets_.size(); ++p) {
      if (packets_[p].size() < 2) continue;
      if (Before(p) > kLongStep * period_ns_ || After(p) > kLongStep * period_ns_) {
        packed += packets_[p].size();
      }
    }
    return packed;
  }
  size_t Tiny() const { return stamps_ns_.size() - packets_.size(); }

  EvenedStamps Evened() const {
    EvenedStamps evened;
    evened.packet = static_cast<double>(stamps_ns_.size()) / static_cast<double>(packets_.size());
    evened.on_arrival =
        static_cast<double>(Packed()) > kArrivalShare * static_cast<double>(stamps_ns_.size());
    evened.stamps_ns = evened.on_arrival ? OnArrival() : Spread();
    evened.rate_hz = 1e9 / SamplingPeriod(evened.stamps_ns);
    return evened;
  }

 private:
  double Step(size_t i, size_t k) const {
    return static_cast<double>(stamps_ns_[k] - stamps_ns_[i]);
  }
  double Before(size_t p) const {
    return p == 0 ? 0 : Step(packets_[p - 1].last, packets_[p].first);
  }
  double After(size_t p) const {
    return p + 1 == packets_.size() ? 0 : Step(packets_[p].last, packets_[p + 1].first);
  }

  // The number that each packet's last sample would have if none was lost.
  std::vector<double> Numbers() const {
    std::vector<double> numbers(packets_.size());
    for (size_t p = 1; p < packets_.size(); ++p) {
      numbers[p] = numbers[p - 1] + static_cast<double>(packets_[p].size()) + LostBefore(p);
    }
    return numbers;
  }

  // The samples that are missing before a packet. One that is only late is caught up with by those
  // that follow.
  double LostBefore(size_t p) const {
    constexpr size_t kFollowing = 3;
    const double least = std::max(1.0, 0.4 * static_cast<double>(packets_[p].size()));
    double samples = 0, lost = std::numeric_limits<double>::max();
    for (size_t q = p; q <= p + kFollowing && q < packets_.size(); ++q) {
      samples += static_cast<double>(packets_[q].size());
      lost = std::min(lost, Step(packets_[p - 1].last, packets_[q].last) / period_ns_ - samples);
    }
    return lost > least ? std::round(lost) : 0;
  }

  // Times by a line through the last samples of the packets within kFit_s on either side.
  std::vector<int64_t> OnArrival() const {
    constexpr double kFit_s = 1;
    const std::vector<double> numbers = Numbers();
    std::vector<int64_t> evened_ns;
    size_t from = 0, to = 0;  // packets of the fit
    for (size_t p = 0; p < packets_.size(); ++p) {
      const auto apart_s = [&](size_t q) {
        return 1e-9 * std::abs(Step(packets_[p].last, packets_[q].last));
      };
      while (apart_s(from) > kFit_s) ++from;
      while (to + 1 < packets_.size() && apart_s(to + 1) <= kFit_s) ++to;
      double n = 0, x = 0, y = 0, xx = 0, xy = 0;  // sums, from packet p
      for (size_t q = from; q <= to; ++q) {
        const double number = numbers[q] - numbers[p];
        const double late_ns = Step(packets_[p].last, packets_[q].last) - number * period_ns_;
        n += 1, x += number, y += late_ns, xx += number * number, xy += number * late_ns;
      }
      const double slope = n > 2 ? (n * xy - x * y) / (n * xx - x * x) : 0;
      const double late_ns = (y - slope * x) / n;
      for (size_t i = packets_[p].first; i <= packets_[p].last; ++i) {
        const double number = -static_cast<double>(packets_[p].last - i);
        evened_ns.push_back(stamps_ns_[packets_[p].last] +
                            std::llround(late_ns + number * (period_ns_ + slope)));
      }
    }
    for (size_t i = 1; i < evened_ns.size(); ++i) {  // lines of neighbours differ a little
      evened_ns[i] = std::max(evened_ns[i], evened_ns[i - 1] + 1);
    }
    return evened_ns;
  }

  // Each packet over the longer of the steps around it.
  std::vector<int64_t> Spread() const {
    std::vector<int64_t> evened_ns = stamps_ns_;
    for (size_t p = 0; p < packets_.size(); ++p) {
      const Packet& packet = packets_[p];
      const double size = static_cast<double>(packet.size());
      const double longer_ns = std::max(Before(p), After(p));
      const bool forward = After(p) >= Before(p);
      const double step_ns =
          std::min(period_ns_, (longer_ns + Step(packet.first, packet.last)) / size);
      for (size_t i = packet.first; i <= packet.last && packet.size() > 1; ++i) {
        evened_ns[i] = forward ? stamps_ns_[packet.first] +
                                     std::llround(step_ns * static_cast<double>(i - packet.first))
                               : stamps_ns_[packet.last] -
                                     std::llround(step_ns * static_cast<double>(packet.last - i));
      }
    }
    for (size_t i = 1; i < evened_ns.size(); ++i) {
      evened_ns[i] = std::max(evened_ns[i], evened_ns[i - 1] + 1);
    }
    return evened_ns;
  }

  const std::vector<int64_t>& stamps_ns_;
  const double period_ns_;
  std::vector<Packet> packets_;
};

}  // namespace

std::optional<EvenedStamps> EvenStamps(const std::vector<int64_t>& stamps_ns) {
  constexpr size_t kMinSamples = 20;
  if (stamps_ns.size() < kMinSamples) return std::nullopt;
  const PacketStamps packets(stamps_ns);
  const auto share = [&](size_t count) {
    return static_cast<double>(count) / static_cast<double>(stamps_ns.size());
  };
  if (share(packets.Tiny()) < kMinTinyShare || share(packets.Packed()) < 2 * kMinTinyShare) {
    return std::nullopt;
  }
  EvenedStamps evened = packets.Evened();
  if (evened.packet > kMaxPacket_s * evened.rate_hz) return std::nullopt;
  return evened;
}

}  // namespace slcmap
