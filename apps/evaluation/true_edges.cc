#include "apps/evaluation/true_edges.h"

#include <set>

#include "data/csv_table.h"
#include "data/error.h"

namespace slcmap {
namespace {

constexpr char kColumns[] = "edge,axis,wing,ax_m,ay_m,az_m,bx_m,by_m,bz_m,seen_from_m,seen_to_m";

bool HasExtent(const PlySegment& segment) {
  return (segment.end_world - segment.start_world).squaredNorm() > 0;
}

Eigen::Vector3d Vector(const CsvTable& table, std::size_t row, std::size_t column) {
  return {table.Number(row, column), table.Number(row, column + 1), table.Number(row, column + 2)};
}

bool SameEnds(const PlySegment& a, const PlySegment& b) {
  return a.start_world == b.start_world && a.end_world == b.end_world;
}

bool IsSeen(const EdgeRow& row) { return row.to_m != row.from_m && HasExtent(row.whole); }

// Of the edges of which something was seen.
TrueEdges SeenEdges(const std::vector<EdgeRow>& rows) {
  std::set<int64_t> seen;
  for (const EdgeRow& row : rows) {
    if (IsSeen(row)) seen.insert(row.edge);
  }
  TrueEdges edges;
  const EdgeRow* last = nullptr;  // of edges.whole; the parts of a piece follow each other
  for (const EdgeRow& row : rows) {
    if (!HasExtent(row.whole)) continue;
    if (!seen.contains(row.edge)) {
      edges.unseen.push_back(row.whole);
      continue;
    }
    if (IsSeen(row)) edges.seen.push_back(row.Seen());
    if (!last || last->edge != row.edge || !SameEnds(last->whole, row.whole)) {
      edges.whole.push_back(row.whole);
      edges.edge_of_whole.push_back(row.edge);
    }
    last = &row;
  }
  return edges;
}

}  // namespace

PlySegment EdgeRow::Seen() const {
  const Eigen::Vector3d direction = (whole.end_world - whole.start_world).normalized();
  return {whole.start_world + from_m * direction, whole.start_world + to_m * direction};
}

std::vector<EdgeRow> ReadEdgeTable(const std::string& path) {
  const CsvTable table = CsvTable::Read(path, kColumns);
  std::vector<EdgeRow> rows(table.rows());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i] = {table.Integer(i, 0),
               table.Integer(i, 1),
               {Vector(table, i, 3), Vector(table, i, 6)},
               table.Number(i, 9),
               table.Number(i, 10)};
    if (rows[i].to_m < rows[i].from_m) table.Fail(i, 10, "at least seen_from_m");
  }
  return rows;
}

TrueEdges ReadTrueEdges(const std::string& path) {
  TrueEdges edges;
  if (path.ends_with(".ply")) {
    edges.seen = ReadLinesPly(path);
    std::erase_if(edges.seen, [](const PlySegment& segment) { return !HasExtent(segment); });
    edges.whole = edges.seen;
  } else {
    edges = SeenEdges(ReadEdgeTable(path));
  }
  if (edges.seen.empty()) throw DataError(path + ": found no edge, expected at least one seen");
  return edges;
}

}  // namespace slcmap
