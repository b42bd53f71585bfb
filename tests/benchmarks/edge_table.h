// The true edges of a simulated sequence, row by row.
#pragma once

#include <string>
#include <vector>

#include "data/csv_table.h"
#include "data/ply.h"

namespace slcmap {

// A part of an edge that the cameras saw; or, of an edge that they did not see, none of it.
struct EdgeRow {
  int edge = 0;
  int axis = -1;     // 0 X, 1 Y, 2 vertical, of its wing; -1 none
  PlySegment whole;  // the edge from end to end, in world
  double from_m = 0, to_m = 0;
};

// Reads truth/edges.csv (data/simulator/edge_visibility.h). Throws DataError.
inline std::vector<EdgeRow> ReadEdgeTable(const std::string& path) {
  const CsvTable table =
      CsvTable::Read(path, "edge,axis,wing,ax_m,ay_m,az_m,bx_m,by_m,bz_m,seen_from_m,seen_to_m");
  std::vector<EdgeRow> rows(table.rows());
  for (size_t i = 0; i < rows.size(); ++i) {
    rows[i].edge = static_cast<int>(table.Integer(i, 0));
    rows[i].axis = static_cast<int>(table.Integer(i, 1));
    for (int k = 0; k < 3; ++k) {
      rows[i].whole.start_world[k] = table.Number(i, 3 + k);
      rows[i].whole.end_world[k] = table.Number(i, 6 + k);
    }
    rows[i].from_m = table.Number(i, 9);
    rows[i].to_m = table.Number(i, 10);
  }
  return rows;
}

}  // namespace slcmap
