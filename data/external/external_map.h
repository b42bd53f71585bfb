// Maps by other systems and laser scans: lines, points and meshes, out of the files that they are
// passed around in.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "data/io/ply.h"

namespace slcmap::inline data {

// As the file has it: in its own world, in metres where it says what its units are.
struct ExternalMap {
  std::string format;  // in words, such as "PCD, binary"
  std::vector<PlySegment> lines;
  std::vector<Eigen::Vector3d> points;
  // Points of a map of ours that were laid on planes, which are flat by that.
  std::vector<Eigen::Vector3d> filled;
  std::vector<std::array<Eigen::Vector3d, 3>> triangles;
  // From one of its single-precision coordinates to the next, where they are largest; 0 of doubles.
  double float_step = 0;
  int64_t left_out = 0;  // places that are not finite, or that a scan calls noise
};

// A file: PLY (points, edges or faces), OBJ, DXF, PCD, LAS, or text with points, with segments, of
// limap, Line3D++ or a marker that `rostopic echo` prints. A folder: of limap, or a map of ours.
// What it is is told by what is in it. Throws DataError, with what to do, where it is compressed,
// cut short, or holds nothing of these.
ExternalMap ReadExternalMap(const std::string& path);

}  // namespace slcmap::data
