// PLY files a layer, and clouds and occupancy in the formats of PCL and OctoMap.
#pragma once

#include "data/io/ply.h"
#include "export/scene/map_writer.h"
#include "export/scene/options.h"
#include "export/scene/scene.h"

namespace slcmap::inline exporting {

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
