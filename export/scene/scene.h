// A map as coloured points, lines and triangles: what every format can be written from.
//
// All coordinates are metres in the world frame, z up. A layer is what a user would switch on and
// off in a viewer; it may be empty.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "data/core/camera.h"
#include "data/core/progress.h"
#include "data/io/trajectory.h"
#include "mapping/map/map.h"

namespace slcmap::inline exporting {

struct Colour {
  uint8_t red = 255, green = 255, blue = 255;
};

// Vertices with a colour each.
struct Vertices {
  std::vector<Eigen::Vector3d> positions;
  std::vector<Colour> colours;

  std::size_t size() const { return positions.size(); }
  void Add(const Eigen::Vector3d& position, const Colour& colour) {
    positions.push_back(position);
    colours.push_back(colour);
  }
};

// Straight edges between pairs of vertices.
struct LineLayer {
  Vertices vertices;
  std::vector<std::array<uint32_t, 2>> edges;
};

// Triangles, counter-clockwise seen from outside.
struct MeshLayer {
  Vertices vertices;
  std::vector<std::array<uint32_t, 3>> triangles;
};

// The layers of a map.
struct MapScene {
  Vertices points;       // coloured by height
  LineLayer lines;       // coloured by axis and age
  LineLayer trajectory;  // by time
  LineLayer keyframes;   // a frustum of the left camera each
  MeshLayer voxels;      // coloured by height
  // The lines once more, for viewers that draw edges a pixel wide, without their colours or not at
  // all.
  MeshLayer line_bars;

  int64_t CountVertices() const;
};

inline constexpr int kMostVertices = 8000000;  // of all layers; some 200 bytes of memory each

// Throws ConfigError for a map that takes more than max_vertices, before any is made, and
// StoppedError when progress says so.
MapScene MakeScene(const MapResult& map, int max_vertices = kMostVertices,
                   const Progress& progress = {});

// Colours for numbers.

// A colour from blue (0) over green and yellow to orange (1); u outside [0, 1] gets the colour of
// the nearer end.
Colour ScaleColour(double u);

// A colour made darker: each part times `factor` in [0, 1].
Colour Shade(const Colour& colour, double factor);

// A camera as a pyramid.

// The image's corners at a depth in metres, in the camera frame, from the top left one clockwise;
// none when the camera has no calibration.
std::vector<Eigen::Vector3d> FrustumCorners(const Camera& camera, double depth_m);

// Where a trajectory has no poses.

// The longest time between two poses that a way is drawn across, in seconds: half a second, and
// more where the poses themselves are that rare, as of pairs taken once a second.
double TrajectoryGap_s(const Trajectory& trajectory);

// Makes the scene of a map once, for all formats that are written from it.
class SceneOfMap {
 public:
  explicit SceneOfMap(int max_vertices) : max_vertices_(max_vertices) {}

  // Throws what MakeScene does. It is always the same map.
  const MapScene& Get(const MapResult& map, const Progress& progress);

 private:
  const int max_vertices_;
  std::optional<MapScene> scene_;
};

}  // namespace slcmap::exporting
