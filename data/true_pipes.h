// The pipes of a simulated building: all that is round and straight.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace slcmap {

// Metres from the start of an axis.
struct SeenStretch {
  double from_m = 0, to_m = 0;
};

struct TruePipe {
  int64_t id = 0;
  Eigen::Vector3d start_world = Eigen::Vector3d::Zero();  // of its axis
  Eigen::Vector3d end_world = Eigen::Vector3d::Zero();
  double radius_m = 0;
  std::vector<SeenStretch> seen;  // by a camera at most 8 m away

  double SeenLength_m() const;
};

// A row a stretch that was seen: `pipe`, `ax_m` to `bz_m` (the ends of the axis in world),
// `radius_m`, `seen_from_m` and `seen_to_m` from its start; both 0 of a pipe that was not seen.
// Throws OutputError.
void WriteTruePipes(const std::string& path, const std::vector<TruePipe>& pipes);

// Throws DataError naming file and row.
std::vector<TruePipe> ReadTruePipes(const std::string& path);

}  // namespace slcmap
