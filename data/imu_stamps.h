// Stamps of an IMU that were given where its samples arrived, not where they were taken.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "data/asl_files.h"

namespace slcmap {

// Stamps that come in packets: runs of them with next to no time in between, then a long step.
struct EvenedStamps {
  std::vector<int64_t> stamps_ns;  // strictly rising, as many as there were
  double rate_hz = 0;              // of the sensor
  double packet = 0;               // mean number of samples in one
  bool on_arrival = false;         // nearly all samples come in packets
};

// The median step between sorted stamps, taken over many of them: of packets, that of the sensor.
// In the stamps' unit; 0 with fewer than two.
template <typename Stamp>
double SamplingPeriod(const std::vector<Stamp>& stamps) {
  constexpr size_t kMaxSteps = 64;
  const size_t steps = std::min(kMaxSteps, stamps.size() / 2);
  if (steps == 0) return 0;
  std::vector<double> periods;
  for (size_t i = 0; i + steps < stamps.size(); ++i) {
    periods.push_back(static_cast<double>(stamps[i + steps] - stamps[i]) /
                      static_cast<double>(steps));
  }
  return Median(std::move(periods));
}

// Gives each sample of a packet a time of its own. Where nearly all come in packets, they were
// stamped on arrival: the last of a packet is nearest to its time, and a line through those within
// some seconds gives the others theirs (what each is late by remains, as one delay). Where most
// have stamps of their own, a packet is spread over the longer of the steps around it. `stamps_ns`
// is sorted, equal ones allowed. Nothing where few samples are in packets, as in good recordings,
// also in those with samples interpolated between others; and where packets would span 0.15 s,
// which no sensor keeps back: then stamps have lost digits.
std::optional<EvenedStamps> EvenStamps(const std::vector<int64_t>& stamps_ns);

}  // namespace slcmap
