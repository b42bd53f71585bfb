// Which images a map's points were seen in, and where there.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <tuple>

namespace slcmap {

// Where a rectified image shows what a point of the map was made of. A track is one feature,
// followed from image to image; a point that was fused of several has as many, which lie a little
// beside it and each other.
struct MapPointObservation {
  int64_t point = 0;     // of the map's, from 0
  int track = 0;         // of the point's, from 0
  int64_t stamp_ns = 0;  // of the image
  int camera = 0;        // 0 left, 1 right
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
};

// What they are ordered by.
inline auto KeyOf(const MapPointObservation& seen) {
  return std::tuple(seen.point, seen.track, seen.stamp_ns, seen.camera);
}

}  // namespace slcmap
