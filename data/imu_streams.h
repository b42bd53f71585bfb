// Tables of IMU samples in which gyroscope and accelerometer are streams of their own, or samples
// come in packets.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "data/clock_jumps.h"
#include "data/types.h"
#include "data/warnings.h"

namespace slcmap {

// The kinds that are counted.
inline constexpr const char* kImuJoined = "imu_streams_joined";
inline constexpr const char* kImuRepeated = "imu_samples_repeated";
inline constexpr const char* kImuOnArrival = "imu_stamped_on_arrival";
inline constexpr const char* kImuStampsShared = "imu_stamps_shared";

// A row with a stamp. What it does not hold, or not as a finite number, is NaN.
struct ImuRow {
  int64_t stamp_ns = 0;
  int number = 0;         // in the file, from 1
  bool is_whole = false;  // holds six numbers, some perhaps not finite
  Eigen::Vector3d angular_velocity_rad_s;
  Eigen::Vector3d specific_force_m_s2;
};

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

}  // namespace slcmap
