#include "data/source/imu_streams.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "data/core/error.h"
#include "data/source/asl_files.h"

namespace slcmap::inline data {
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

namespace {

constexpr double kMinAbsentShare = 0.1;  // of rows without a half, where these are streams

using Half = Eigen::Vector3d ImuRow::*;
constexpr Half kGyro = &ImuRow::angular_velocity_rad_s, kAccel = &ImuRow::specific_force_m_s2;

bool IsThere(const Eigen::Vector3d& reading) { return reading.allFinite(); }

void Erase(Eigen::Vector3d* reading) {
  reading->setConstant(std::numeric_limits<double>::quiet_NaN());
}

// Rows that hold the other half only.
size_t CountWithout(const std::vector<ImuRow>& rows, Half half) {
  const Half other = half == kGyro ? kAccel : kGyro;
  return std::count_if(rows.begin(), rows.end(), [&](const ImuRow& row) {
    return !IsThere(row.*half) && IsThere(row.*other);
  });
}

bool IsMany(size_t count, const std::vector<ImuRow>& rows) {
  return static_cast<double>(count) >= kMinAbsentShare * static_cast<double>(rows.size());
}

}  // namespace

bool LackHalves(const std::vector<ImuRow>& rows) {
  return !rows.empty() && IsMany(CountWithout(rows, kGyro) + CountWithout(rows, kAccel), rows);
}

namespace {

// Zeros that stand for nothing: forces, as gravity is always felt, and turn rates wherever a row
// holds a force in such a table.
void EraseZeros(std::vector<ImuRow>* rows) {
  const auto is_zero = [](const Eigen::Vector3d& reading) { return reading.isZero(0); };
  size_t forceless = 0, turning = 0, forces = 0;
  for (const ImuRow& row : *rows) {
    if (is_zero(row.*kAccel)) {
      ++forceless;
    } else if (IsThere(row.*kAccel)) {
      ++forces;
      turning += !is_zero(row.*kGyro);
    }
  }
  if (!IsMany(forceless, *rows) || !IsMany(forces, *rows)) return;
  const bool apart = !IsMany(turning, *rows);
  for (ImuRow& row : *rows) {
    if (is_zero(row.*kAccel)) {
      Erase(&(row.*kAccel));
    } else if (apart && is_zero(row.*kGyro)) {
      Erase(&(row.*kGyro));
    }
  }
}

// For each row, whether a half is another than in the row before.
std::vector<bool> Fresh(const std::vector<ImuRow>& rows, Half half) {
  std::vector<bool> fresh(rows.size(), true);
  for (size_t i = 1; i < rows.size(); ++i) fresh[i] = rows[i].*half != rows[i - 1].*half;
  return fresh;
}

// Whether a half is renewed at a steady rate below that of the rows: so many changes take as many
// rows, to one or two, all along. Readings that are equal by chance do not keep step.
bool IsHeld(const std::vector<bool>& fresh) {
  constexpr size_t kChanges = 30, kMinChanges = 120;
  constexpr double kMinRows = 1.15 * kChanges;  // that they take
  constexpr double kMaxOff_rows = 1.5, kMinSteady = 0.8;
  std::vector<size_t> changes;
  for (size_t i = 0; i < fresh.size(); ++i) {
    if (fresh[i]) changes.push_back(i);
  }
  if (changes.size() < kMinChanges) return false;
  std::vector<double> rows;
  for (size_t i = kChanges; i < changes.size(); ++i) {
    rows.push_back(static_cast<double>(changes[i] - changes[i - kChanges]));
  }
  const double median = Median(rows);
  const auto steady = std::count_if(rows.begin(), rows.end(), [&](double count) {
    return std::abs(count - median) <= kMaxOff_rows;
  });
  return median >= kMinRows &&
         static_cast<double>(steady) >= kMinSteady * static_cast<double>(rows.size());
}

// Leaves each half where it is renewed, and no row of those that repeat both.
void EraseHeld(const std::string& path, std::vector<ImuRow>* rows, Warnings* warnings) {
  if (LackHalves(*rows)) return;
  const std::vector<bool> gyro = Fresh(*rows, kGyro), accel = Fresh(*rows, kAccel);
  const bool gyro_held = IsHeld(gyro), accel_held = IsHeld(accel);
  if (!gyro_held && !accel_held) return;
  std::vector<ImuRow> renewed;
  for (size_t i = 0; i < rows->size(); ++i) {
    ImuRow row = (*rows)[i];
    if (gyro_held && accel_held && !gyro[i] && !accel[i]) {
      warnings->Add(kImuRepeated, fmt::format("{}: row {}", path, row.number));
      continue;
    }
    if (gyro_held && !gyro[i]) Erase(&(row.*kGyro));
    if (accel_held && !accel[i]) Erase(&(row.*kAccel));
    renewed.push_back(row);
  }
  *rows = std::move(renewed);
}

bool IsSameRow(const ImuRow& a, const ImuRow& b) {
  return a.stamp_ns == b.stamp_ns && a.*kGyro == b.*kGyro && a.*kAccel == b.*kAccel;
}

// The places of the stamps in order, of equal ones as they come.
std::vector<int64_t> Ranks(const std::vector<int64_t>& stamps_ns) {
  std::vector<size_t> order(stamps_ns.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return stamps_ns[a] < stamps_ns[b]; });
  std::vector<int64_t> ranks(stamps_ns.size());
  for (size_t k = 0; k < order.size(); ++k) ranks[order[k]] = static_cast<int64_t>(k);
  return ranks;
}

// Gives the samples of packets stamps of their own. Rows out of place, and those that repeat the
// one before, are left for others to judge.
void EvenOut(const std::string& path, std::vector<ImuRow>* rows, Warnings* warnings) {
  constexpr double kMinInPlace = 0.9;
  std::vector<int64_t> all_ns, stamps_ns;
  for (const ImuRow& row : *rows) all_ns.push_back(row.stamp_ns);
  std::vector<size_t> taken;
  for (const size_t i : LongestRising(Ranks(all_ns))) {
    if (taken.empty() || !IsSameRow((*rows)[taken.back()], (*rows)[i])) taken.push_back(i);
  }
  if (static_cast<double>(taken.size()) < kMinInPlace * static_cast<double>(rows->size())) return;
  for (const size_t i : taken) stamps_ns.push_back(all_ns[i]);
  const std::optional<EvenedStamps> evened = EvenStamps(stamps_ns);
  if (!evened) return;
  for (size_t k = 0; k < taken.size(); ++k) (*rows)[taken[k]].stamp_ns = evened->stamps_ns[k];
  if (evened->on_arrival) {
    warnings->Add(kImuOnArrival,
                  fmt::format("{}: packets of {:.3g} samples, evened out to {:.4g} Hz", path,
                              evened->packet, evened->rate_hz));
  } else {
    warnings->Add(kImuStampsShared, fmt::format("{}: some samples share a stamp before or after a "
                                                "long step, evened out to {:.4g} Hz",
                                                path, evened->rate_hz));
  }
}

// The rows that hold a half, in their order.
std::vector<ImuRow> RowsWith(const std::vector<ImuRow>& rows, Half half) {
  std::vector<ImuRow> stream;
  for (const ImuRow& row : rows) {
    if (IsThere(row.*half)) stream.push_back(row);
  }
  return stream;
}

// Puts both on the clock before, where it was set back, and by as much. Returns the gyroscope's
// jumps, and counts those of the accelerometer alone.
std::vector<ClockJump> RestoreClocks(const std::string& path, std::vector<ImuRow>* gyro,
                                     std::vector<ImuRow>* accel, Warnings* warnings) {
  const auto restore = [&](std::vector<ImuRow>* stream, Half half) {
    return RestoreClock(
        [half](const ImuRow& a, const ImuRow& b) { return a.*half == b.*half; },
        [&](size_t row) { return fmt::format("{}: row {}", path, (*stream)[row].number); }, stream);
  };
  std::vector<ClockJump> jumps = restore(gyro, kGyro), of_accel = restore(accel, kAccel);
  ClockTable<ImuRow> other{accel, &of_accel};
  AgreeOnJumps(ClockTable<ImuRow>{gyro, &jumps}, &other);
  std::erase_if(of_accel, [&](const ClockJump& jump) {
    return !jump.put_back || SameJump(jump, jumps) < jumps.size();
  });
  CountJumps(of_accel, warnings);
  return jumps;
}

// By their stamps, which are evened out where they came in packets.
std::vector<ImuRow> Stream(const std::string& path, std::vector<ImuRow> stream,
                           Warnings* warnings) {
  const auto by_stamp = [](const ImuRow& a, const ImuRow& b) { return a.stamp_ns < b.stamp_ns; };
  std::stable_sort(stream.begin(), stream.end(), by_stamp);
  EvenOut(path, &stream, warnings);
  return stream;
}

double Rate_hz(const std::vector<ImuRow>& stream) {
  std::vector<int64_t> stamps_ns;
  for (const ImuRow& row : stream) stamps_ns.push_back(row.stamp_ns);
  const double period_ns = SamplingPeriod(stamps_ns);
  return period_ns > 0 ? 1e9 / period_ns : 0;
}

void RequireRate(const std::string& path, const char* sensor, size_t count, double rate_hz) {
  constexpr double kMinRate_hz = 20;
  if (rate_hz >= kMinRate_hz) return;
  throw InputFault(
      "imu-streams",
      fmt::format(
          "{}: found {} readings of the {}, at {:.3g} Hz, in rows of their own, expected at "
          "least {} Hz",
          path, count, sensor, rate_hz, kMinRate_hz),
      fmt::format(
          "record the {} too, at 100 Hz or more (of a RealSense: enable both, and unite them "
          "with unite_imu_method)",
          sensor));
}

// The gyroscope's rows with the force interpolated between the accelerometer's.
std::vector<ImuRow> Joined(const std::vector<ImuRow>& gyro, const std::vector<ImuRow>& accel,
                           double accel_rate_hz) {
  const double longest_ns = 4e9 / accel_rate_hz;
  std::vector<ImuRow> joined;
  size_t after = 1;
  for (const ImuRow& row : gyro) {
    while (after + 1 < accel.size() && accel[after].stamp_ns < row.stamp_ns) ++after;
    const ImuRow &a = accel[after - 1], &b = accel[after];
    const double step_ns = static_cast<double>(b.stamp_ns - a.stamp_ns);
    if (row.stamp_ns < a.stamp_ns || row.stamp_ns > b.stamp_ns) continue;
    if (step_ns > longest_ns || step_ns <= 0) continue;
    const double u = static_cast<double>(row.stamp_ns - a.stamp_ns) / step_ns;
    joined.push_back(row);
    joined.back().specific_force_m_s2 = (1 - u) * a.*kAccel + u * b.*kAccel;
  }
  return joined;
}

}  // namespace

std::vector<ImuRow> JoinImuStreams(const std::string& path, std::vector<ImuRow> rows,
                                   Warnings* warnings, std::vector<ClockJump>* jumps) {
  if (rows.empty()) return rows;  // which others tell of
  EraseZeros(&rows);
  EraseHeld(path, &rows, warnings);
  if (!LackHalves(rows)) {
    EvenOut(path, &rows, warnings);
    return rows;
  }
  std::vector<ImuRow> gyro = RowsWith(rows, kGyro), accel = RowsWith(rows, kAccel);
  if (jumps != nullptr) *jumps = RestoreClocks(path, &gyro, &accel, warnings);
  gyro = Stream(path, std::move(gyro), warnings);
  accel = Stream(path, std::move(accel), warnings);
  const double gyro_hz = Rate_hz(gyro), accel_hz = Rate_hz(accel);
  RequireRate(path, "gyroscope", gyro.size(), gyro_hz);
  RequireRate(path, "accelerometer", accel.size(), accel_hz);
  warnings->Add(kImuJoined, fmt::format("{}: gyroscope at {:.4g} Hz, accelerometer at {:.4g} Hz, "
                                        "joined at the gyroscope's stamps",
                                        path, gyro_hz, accel_hz));
  return Joined(gyro, accel, accel_hz);
}

}  // namespace slcmap::data
