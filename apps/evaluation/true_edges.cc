#include "apps/evaluation/true_edges.h"

#include <optional>

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

// Of the edges of which something was seen.
TrueEdges SeenEdges(const std::vector<EdgeRow>& rows) {
  TrueEdges edges;
  std::optional<int64_t> last_edge;  // of edges.whole; the parts of an edge follow each other
  for (const EdgeRow& row : rows) {
    if (row.to_m == row.from_m || !HasExtent(row.whole)) continue;
    edges.seen.push_back(row.Seen());
    if (last_edge != row.edge) edges.whole.push_back(row.whole);
    last_edge = row.edge;
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
