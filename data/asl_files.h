// The tables of an ASL folder (EuRoC, TUM VI): image lists and IMU samples.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "data/clock_jumps.h"
#include "data/types.h"
#include "data/warnings.h"

namespace slcmap {

struct ImageFile {
  int64_t stamp_ns = 0;
  std::string path;
};

// Reads <camera_folder>/data.csv: "stamp_ns, file". The file is taken relative to data/, to the
// camera's folder or to the folder above, whichever holds the first one; without that column it is
// data/<stamp_ns>.png. Rows that cannot be read, and those outside the longest rising sequence of
// stamps, are counted and dropped; a table with more than a fifth of its rows out of place is
// sorted instead, and only its repeated stamps are dropped. Throws DataError when the file is
// missing or no row is left, InputFault when the stamps seem to be in another unit than nanoseconds
// or have lost digits, and when most rows cannot be read or have no stamp of their own. Where the
// clock was set back, what follows is put on the clock before, and added to `jumps`, as are long
// gaps; without `jumps` stamps stay as they are.
std::vector<ImageFile> ReadAslImages(const std::string& camera_folder, Warnings* warnings,
                                     std::vector<ClockJump>* jumps = nullptr);

// Reads an ASL imu0/data.csv: "stamp_ns, wx, wy, wz, ax, ay, az" in rad/s and m/s^2; more columns
// are ignored. Bad rows as above, also those that are not finite. Rows that hold one sensor only
// are joined, and packets stamped on arrival evened out (JoinImuStreams). Gaps are counted. Throws
// InputFault as above, and where the comment that heads the table says another order.
std::vector<ImuSample> ReadAslImu(const std::string& path, Warnings* warnings,
                                  std::vector<ClockJump>* jumps = nullptr);

// The median step between sorted stamps in seconds, 0 with fewer than two. Elements have stamp_ns.
template <typename Stamped>
double MedianStep_s(const std::vector<Stamped>& elements);

// Indices of the longest strictly rising subsequence, so that one absurd stamp costs one row.
std::vector<size_t> LongestRising(const std::vector<int64_t>& stamps_ns);

double Median(std::vector<double> values);  // 0 when empty

template <typename Stamped>
double MedianStep_s(const std::vector<Stamped>& elements) {
  std::vector<double> steps_s;
  for (size_t i = 1; i < elements.size(); ++i) {
    steps_s.push_back(ToSeconds(elements[i].stamp_ns - elements[i - 1].stamp_ns));
  }
  return Median(std::move(steps_s));
}

}  // namespace slcmap
