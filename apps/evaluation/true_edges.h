// The true edges of a building that a line map is compared with.
#pragma once

#include <string>
#include <vector>

#include "data/ply.h"

namespace slcmap {

struct TrueEdges {
  std::vector<PlySegment> whole;  // edges of which the cameras saw a part, from end to end
  std::vector<PlySegment> seen;   // the parts that they saw
};

// Reads edges.csv as the simulator writes it (data/simulator/edge_visibility.h), or the edges of an
// edge-PLY (a path that ends in ".ply"), all seen. Throws DataError naming file and row, also when
// there is no edge with an extent.
TrueEdges ReadTrueEdges(const std::string& path);

}  // namespace slcmap
