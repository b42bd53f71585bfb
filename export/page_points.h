// The dense cloud as a page holds it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "data/progress.h"
#include "mapping/dense/dense_point.h"

namespace slcmap {

inline constexpr double kPageChunk_m = 32;

// A cube of edge kPageChunk_m and the points in it.
struct PageChunk {
  Eigen::Vector3d corner_m = Eigen::Vector3d::Zero();  // lowest, relative to the origin
  std::size_t from = 0, count = 0;
};

// Points by chunk and, in a chunk, in Morton order: neighbours in space are neighbours in the list.
struct PagePoints {
  std::vector<PageChunk> chunks;
  std::vector<uint16_t> x, y, z;  // from the chunk's corner, 65535 for its far side
  std::vector<uint8_t> grey, sigma, source;
};

// The code of a standard deviation: 16 log2(sigma / 0.1 mm), rounded, within a byte: to 2 % up to
// 6 m.
uint8_t SigmaCode(double sigma_m);

// Throws StoppedError when progress says so.
PagePoints ChunkPoints(const std::vector<DensePoint>& points, const Eigen::Vector3d& origin_world,
                       const Progress& progress = {});

}  // namespace slcmap
