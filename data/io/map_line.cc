#include "data/io/map_line.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "data/core/error.h"
#include "data/io/csv.h"
#include "data/io/file.h"
#include "data/io/ply.h"

namespace slcmap::inline data {
namespace {

using Rgb = std::array<uint8_t, 3>;

constexpr std::array<Rgb, 5> kAxisColours = {{{255, 90, 80},
                                              {80, 220, 100},
                                              {90, 150, 255},
                                              {240, 190, 70},
                                              {220, 110, 230}}};  // by LineAxis
// Not darker: viewers that take glTF's linear colours for those of the screen square it, nearly.
constexpr double kOldShade = 0.8;

PlyElement VertexElement(const std::vector<MapLine>& lines) {
  PlyElement vertices{"vertex", {}};
  for (const char* name : {"x", "y", "z"}) vertices.Add(name, PlyType::kFloat);
  for (const char* name : {"red", "green", "blue"}) vertices.Add(name, PlyType::kUint8);
  for (const MapLine& line : lines) {
    const auto [red, green, blue] = LineColour(line.axis, line.recent);
    for (const Eigen::Vector3d& p : {line.start_world, line.end_world}) {
      vertices.AppendRow({p.x(), p.y(), p.z(), static_cast<double>(red), static_cast<double>(green),
                          static_cast<double>(blue)});
    }
  }
  return vertices;
}

PlyElement EdgeElement(const std::vector<MapLine>& lines) {
  PlyElement edges{"edge", {}};
  for (const char* name : {"vertex1", "vertex2"}) edges.Add(name, PlyType::kInt32);
  for (const char* name : {"red", "green", "blue"}) edges.Add(name, PlyType::kUint8);
  for (const char* name : {"id", "segment", "axis", "world"}) edges.Add(name, PlyType::kInt32);
  edges.Add("sigma_m", PlyType::kFloat);
  edges.Add("recent", PlyType::kUint8);
  edges.Add("observations", PlyType::kInt32);
  for (const char* name : {"deviation_rad", "deviation_sigma_rad"})
    edges.Add(name, PlyType::kFloat);
  edges.Add("kind", PlyType::kUint8);
  edges.Add("edge_probability", PlyType::kFloat);
  for (const MapLine& line : lines) {
    const auto [red, green, blue] = LineColour(line.axis, line.recent);
    const double first = 2 * static_cast<double>(edges.size());
    edges.AppendRow(
        {first, first + 1, static_cast<double>(red), static_cast<double>(green),
         static_cast<double>(blue), static_cast<double>(line.id), static_cast<double>(line.segment),
         static_cast<double>(line.axis), static_cast<double>(line.world), line.sigma_m,
         line.recent ? 1.0 : 0.0, static_cast<double>(line.observations), line.deviation_rad,
         line.deviation_sigma_rad, static_cast<double>(line.kind), line.edge_probability});
  }
  return edges;
}

// The properties of edges that a file may lack.
class EdgeReader {
 public:
  EdgeReader(const std::string& path, const PlyElement& edges) : path_(path), edges_(edges) {}

  // The value of a row, which must not be below `least` nor above `most`; `missing` where the file
  // has no such property.
  double Value(const char* name, std::size_t row, double missing, double least, double most) const {
    const auto property =
        std::find_if(edges_.properties.begin(), edges_.properties.end(),
                     [&](const PlyProperty& candidate) { return candidate.name == name; });
    if (property == edges_.properties.end()) return missing;
    const double value = property->values[row];
    if (value >= least && value <= most) return value;
    throw DataError(fmt::format("{}: edge row {}: {}: found {}, expected {} to {}", path_, row + 1,
                                name, value, least, most));
  }

 private:
  const std::string& path_;
  const PlyElement& edges_;
};

}  // namespace

Rgb LineColour(LineAxis axis, bool recent) {
  Rgb colour = kAxisColours[static_cast<std::size_t>(axis)];
  if (recent) return colour;
  for (uint8_t& part : colour) part = static_cast<uint8_t>(std::lround(kOldShade * part));
  return colour;
}

void WriteMapLines(const std::string& path, const std::vector<MapLine>& lines) {
  WritePly(path,
           {{"slcmap lines, metres in the world frame, z up",
             "axis: 0 X, 1 Y, 2 vertical, 3 none, 4 sloped; recent: seen by the last keyframes",
             "kind: 0 unknown, 1 edge, 3 mark, 4 pipe"},
            {VertexElement(lines), EdgeElement(lines)},
            {}});
}

std::vector<MapLine> ReadMapLines(const std::string& path) {
  constexpr double kMaxInt = 2147483647, kMaxSigma_m = 1e9, kMaxSigma_rad = 1e9;
  const PlyFile file = ReadPly(path);
  const std::vector<PlySegment> segments = Segments(file, path);
  const EdgeReader edges(path, file.Get("edge", path));
  std::vector<MapLine> lines(segments.size());
  for (std::size_t i = 0; i < lines.size(); ++i) {
    MapLine& line = lines[i];
    line.start_world = segments[i].start_world;
    line.end_world = segments[i].end_world;
    line.id = static_cast<int64_t>(edges.Value("id", i, static_cast<double>(i), 0, kMaxInt));
    line.segment = static_cast<int>(edges.Value("segment", i, 0, 0, kMaxInt));
    line.axis = static_cast<LineAxis>(edges.Value("axis", i, 3, 0, 4));
    line.world = static_cast<int>(edges.Value("world", i, -1, -1, kMaxInt));
    line.sigma_m = edges.Value("sigma_m", i, 0, 0, kMaxSigma_m);
    line.recent = edges.Value("recent", i, 0, 0, 1) != 0;
    line.observations = static_cast<int>(edges.Value("observations", i, 0, 0, kMaxInt));
    line.deviation_rad = edges.Value("deviation_rad", i, 0, 0, M_PI);
    line.deviation_sigma_rad = edges.Value("deviation_sigma_rad", i, 0, 0, kMaxSigma_rad);
    // Outlines of flat things on surfaces, which earlier versions told apart (2), are edges.
    const int kind = static_cast<int>(edges.Value("kind", i, 0, 0, 4));
    line.kind = kind == 2 ? LineKind::kEdge : static_cast<LineKind>(kind);
    line.edge_probability = edges.Value("edge_probability", i, 0.5, 0, 1);
  }
  return lines;
}

namespace {

constexpr double kMost_m = 1e5, kMostId = 1e8;

CsvColumns PipeColumns() {
  CsvColumns columns = {{"pipe", CsvColumn::Kind::kInteger, 0, kMostId}};
  for (const char* name : {"ax_m", "ay_m", "az_m", "bx_m", "by_m", "bz_m"}) {
    columns.push_back({name, CsvColumn::Kind::kNumber, -kMost_m, kMost_m});
  }
  for (const char* name : {"radius_m", "seen_from_m", "seen_to_m"}) {
    columns.push_back({name, CsvColumn::Kind::kNumber, 0, kMost_m});
  }
  return columns;
}

std::string Row(const TruePipe& pipe, const Interval& seen) {
  const Eigen::Vector3d &a = pipe.start_world, &b = pipe.end_world;
  return fmt::format("{},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f}\n", pipe.id,
                     a.x(), a.y(), a.z(), b.x(), b.y(), b.z(), pipe.radius_m, seen.from_m,
                     seen.to_m);
}

}  // namespace

double TruePipe::SeenLength_m() const {
  double length_m = 0;
  for (const Interval& stretch : seen) length_m += stretch.to_m - stretch.from_m;
  return length_m;
}

void WriteTruePipes(const std::string& path, const std::vector<TruePipe>& pipes) {
  std::string text = CsvHeader(PipeColumns()) + "\n";
  for (const TruePipe& pipe : pipes) {
    if (pipe.seen.empty()) text += Row(pipe, {});
    for (const Interval& stretch : pipe.seen) text += Row(pipe, stretch);
  }
  WriteFile(path, text);
}

std::vector<TruePipe> ReadTruePipes(const std::string& path) {
  const CsvTable table = CsvTable::Read(path, PipeColumns());
  std::vector<TruePipe> pipes;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const int64_t id = table.Integer(row, 0);
    if (pipes.empty() || pipes.back().id != id) {
      const auto point = [&](std::size_t column) -> Eigen::Vector3d {
        return {table.Number(row, column), table.Number(row, column + 1),
                table.Number(row, column + 2)};
      };
      pipes.push_back({id, point(1), point(4), table.Number(row, 7), {}});
    }
    const Interval stretch{table.Number(row, 8), table.Number(row, 9)};
    if (stretch.to_m < stretch.from_m) table.Fail(row, 9, "at least seen_from_m");
    if (stretch.to_m > stretch.from_m) pipes.back().seen.push_back(stretch);
  }
  return pipes;
}

}  // namespace slcmap::data
