// Lines of a building as lines.ply holds them, in run folders and in map folders; and the pipes of
// a simulated building: all that is round and straight.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "data/core/math.h"
#include "data/core/types.h"

namespace slcmap::inline data {

// What a line is of. Files hold these numbers.
enum class LineKind {
  kUnknown = 0,
  kEdge = 1,  // where surfaces meet, or one ends before another
  kMark = 3,  // on a surface: grain, a joint, print, a shadow
  kPipe = 4,  // the axis of a pipe
};

// A straight piece of a line: of a line with gaps there are several, which share its id.
struct MapLine {
  int64_t id = 0;
  int segment = 0;                  // of the run
  LineAxis axis = LineAxis::kNone;  // kNone: it follows no direction of the building
  // The Manhattan world whose axis it has, of a sloped line its sloped direction; -1: none, or
  // vertical.
  int world = -1;
  // Standard deviation across it, where that is largest, against other lines of the map.
  double sigma_m = 0;
  bool recent = false;  // the last keyframes of the run saw it
  Eigen::Vector3d start_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d end_world = Eigen::Vector3d::Zero();
  // Keyframes that saw it; 0 of a junction, where planes of the building meet and no image shows
  // it.
  int observations = 0;
  // The angle between it and its axis, and the standard deviation of its direction, as the root of
  // the mean square of those in the two directions across it; both 0 of a line that was taken to be
  // exactly along its axis, of one that has none, and of a junction.
  double deviation_rad = 0, deviation_sigma_rad = 0;
  LineKind kind = LineKind::kUnknown;
  double edge_probability = 0.5;  // that it is an edge, and no mark

  void SetProbability(double probability) {
    edge_probability = probability;
    kind = probability < 0.5 ? LineKind::kMark : LineKind::kEdge;
  }
};

// Of a map's line: it was derived from planes of the building, not seen.
inline bool IsJunction(const MapLine& line) { return line.observations == 0; }

// Red, green and blue: X is red, Y green, vertical blue, none amber, sloped violet. Recent lines
// are bright, old ones dark.
std::array<uint8_t, 3> LineColour(LineAxis axis, bool recent);

// Writes an edge-PLY: float positions and colours of vertices, and edges with vertex1, vertex2,
// colours, and what MapLine holds under its names. No lines make a valid file too. Throws
// OutputError.
void WriteMapLines(const std::string& path, const std::vector<MapLine>& lines);

// Reads any edge-PLY; of a file without them, ids count the edges and the other properties are
// those of a default MapLine. Throws DataError naming the file, and the row of a value that cannot
// be.
std::vector<MapLine> ReadMapLines(const std::string& path);

struct TruePipe {
  int64_t id = 0;
  Eigen::Vector3d start_world = Eigen::Vector3d::Zero();  // of its axis
  Eigen::Vector3d end_world = Eigen::Vector3d::Zero();
  double radius_m = 0;
  std::vector<Interval> seen;  // along its axis, by a camera at most 8 m away

  double SeenLength_m() const;
};

// A row a stretch that was seen: `pipe`, `ax_m` to `bz_m` (the ends of the axis in world),
// `radius_m`, `seen_from_m` and `seen_to_m` from its start; both 0 of a pipe that was not seen.
// Throws OutputError.
void WriteTruePipes(const std::string& path, const std::vector<TruePipe>& pipes);

// Throws DataError naming file and row.
std::vector<TruePipe> ReadTruePipes(const std::string& path);

}  // namespace slcmap::data
