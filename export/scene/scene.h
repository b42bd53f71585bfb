// A map as coloured points, lines and triangles: what every format can be written from.
//
// All coordinates are metres in the world frame, z up. A layer is what a user would switch on and
// off in a viewer; it may be empty.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "data/core/camera.h"
#include "data/core/coordinate_system.h"
#include "data/core/progress.h"
#include "data/io/trajectory.h"
#include "export/scene/map_writer.h"
#include "export/scene/options.h"
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

struct PointLayer {
  std::string name;
  Vertices vertices;
};

// Straight edges between pairs of vertices.
struct LineLayer {
  std::string name;
  Vertices vertices;
  std::vector<std::array<uint32_t, 2>> edges;
};

// Triangles, counter-clockwise seen from outside.
struct MeshLayer {
  std::string name;
  Vertices vertices;
  std::vector<std::array<uint32_t, 3>> triangles;
};

struct MapScene {
  std::string map_id, run_id;                     // of what it shows; "" where that is not known
  std::optional<Georeference> georeference = {};  // as MapSource has it
  std::vector<PointLayer> points;
  std::vector<LineLayer> lines;
  std::vector<MeshLayer> meshes;
};

// The layers of a map: points ("points", coloured by height), lines ("lines" coloured by axis and
// age, "trajectory" by time, "keyframes": a frustum of the left camera each) and meshes ("voxels",
// coloured by height, and "line_bars": the lines once more, for viewers that draw edges a pixel
// wide, without their colours or not at all). Throws ConfigError for a map that takes more than
// max_vertices, before any is made, and StoppedError when progress says so.
MapScene MakeScene(const MapResult& map, const SceneOptions& options,
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

// The longest time between two poses that a way is drawn across, in seconds: max_jump_s, and more
// where the poses themselves are that rare, as of pairs taken once a second.
double TrajectoryGap_s(const Trajectory& trajectory, double max_jump_s);

// The formats that coloured geometry can be written in.

// Makes the scene of a map once, for all formats that are written from it.
class SceneOfMap {
 public:
  explicit SceneOfMap(const SceneOptions& options) : options_(options) {}

  // Throws what MakeScene does. Maps are told apart by their address.
  const MapScene& Of(const MapResult& map, const Progress& progress);

 private:
  SceneOptions options_;
  const MapResult* map_ = nullptr;
  MapScene scene_;
};

// Writes the scene of a map in one format.
class SceneWriter : public MapWriter {
 public:
  explicit SceneWriter(std::shared_ptr<SceneOfMap> scene) : scene_(std::move(scene)) {}

  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const final;

 protected:
  // As Write() of a map.
  virtual std::vector<std::string> WriteScene(const std::string& folder, const MapScene& scene,
                                              const Progress& progress) const = 0;

 private:
  std::shared_ptr<SceneOfMap> scene_;
};

// A PLY file a layer, for MeshLab, CloudCompare, Blender and Open3D.

// Writes NAME.ply for each layer: coloured vertices, and edges (vertex1, vertex2) or triangles
// between them. Empty layers are written too, so that no file of an earlier export is left.
class PlySceneWriter : public SceneWriter {
 public:
  explicit PlySceneWriter(std::shared_ptr<SceneOfMap> scene, const PlyOptions& options = {})
      : SceneWriter(std::move(scene)), options_(options) {}
  std::string Format() const override { return "ply"; }
  std::vector<std::string> Names() const override;

 protected:
  std::vector<std::string> WriteScene(const std::string& folder, const MapScene& scene,
                                      const Progress& progress) const override;

 private:
  const PlyOptions options_;
};

// Clouds and occupancy in the formats of PCL and OctoMap.

// Writes points.pcd, dense.pcd, dense.ply and occupancy.bt, as a map folder holds them, but
// dense.ply in the form that is asked for.
class CloudWriter : public MapWriter {
 public:
  explicit CloudWriter(const PlyOptions& options = {}) : options_(options) {}
  std::string Format() const override { return "cloud"; }
  std::vector<std::string> Names() const override;
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;

 private:
  const PlyOptions options_;
};

}  // namespace slcmap::exporting
