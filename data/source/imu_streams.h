// IMU samples whose stamps were given where they arrived, not where they were taken, and tables in
// which gyroscope and accelerometer are streams of their own.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "data/core/error.h"
#include "data/core/types.h"
#include "data/source/asl_files.h"

namespace slcmap::inline data {

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

// The kinds that are counted.
inline constexpr const char* kImuJoined = "imu_streams_joined";
inline constexpr const char* kImuRepeated = "imu_samples_repeated";
inline constexpr const char* kImuOnArrival = "imu_stamped_on_arrival";
inline constexpr const char* kImuStampsShared = "imu_stamps_shared";

// Whether so many rows lack a half that these are streams of their own.
bool LackHalves(const std::vector<ImuRow>& rows);

// Whether the table is one of streams: rows that lack a half, as it is blank or NaN, as forces of
// exactly zero stand among others, or as a half is repeated at a steady rate until the next is
// there. Not where single rows are damaged, where a sensor at rest repeats coarse readings as noise
// has it, or where an axis is dead.
//
// Then the rows become samples: the gyroscope's, with the force interpolated between those on
// either side (nothing beyond the ends and across gaps). Others stay as they are, but for whole
// samples that are repeated at a steady rate, which are left out, and stamps, which are evened out
// (EvenStamps). All of it is counted in warnings. Streams whose clock was set back are put on the
// clock before, which is added to `jumps`; without `jumps` stamps stay as they are. Throws
// InputFault where a half is missing altogether or too slow to be of use.
std::vector<ImuRow> JoinImuStreams(const std::string& path, std::vector<ImuRow> rows,
                                   Warnings* warnings, std::vector<ClockJump>* jumps = nullptr);

}  // namespace slcmap::data
