// The true edges of a building that a line map is compared with.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "data/ply.h"

namespace slcmap {

struct TrueEdges {
  // Edges of which the cameras saw a part, from end to end; of those that are bent, their straight
  // pieces.
  std::vector<PlySegment> whole;
  std::vector<PlySegment> seen;  // the parts that they saw
  // Which edge each of `whole` is of: pieces of one have the same. Empty: each is an edge.
  std::vector<int64_t> edge_of_whole = {};
  // The parts that they saw well (clear_edges.h), where that is known.
  std::optional<std::vector<PlySegment>> clear = {};
  std::vector<PlySegment> unseen = {};  // edges of which they saw nothing
  // Outlines of the openings that one goes through, on each face of a wall.
  std::vector<std::vector<Eigen::Vector3d>> doorways = {};
  std::vector<std::vector<Eigen::Vector3d>> openings = {};  // outlines of all doors and windows
};

// A row of edges.csv: a part of an edge, or of a straight piece of a bent one, that the cameras
// saw; or, where they did not see any of it, none.
struct EdgeRow {
  int64_t edge = 0;
  int64_t axis = -1;  // 0 X, 1 Y, 2 vertical, of its wing; -1 none
  PlySegment whole;   // the edge or the piece from end to end, in world
  double from_m = 0, to_m = 0;

  PlySegment Seen() const;
};

// Reads edges.csv as the simulator writes it (data/simulator/edge_visibility.h). Throws DataError
// naming file and row.
std::vector<EdgeRow> ReadEdgeTable(const std::string& path);

// Reads edges.csv, or the edges of an edge-PLY (a path that ends in ".ply"), all seen. Throws
// DataError naming file and row, also when there is no edge with an extent.
TrueEdges ReadTrueEdges(const std::string& path);

}  // namespace slcmap
