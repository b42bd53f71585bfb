// A map as a tileset that viewers load by parts (OGC 3D Tiles 1.1), as on a server of files.
#pragma once

#include <string>
#include <vector>

#include "export/scene/map_writer.h"
#include "export/scene/options.h"
#include "export/web/cloud_tiles.h"

namespace slcmap::inline exporting {

// Writes tiles/tileset.json: the clouds "dense", "filled" and "points" as octrees with implicit
// tiling (cloud_tiles.h), lines as a tree of GLB files, the longest first, and of each storey its
// walls, other planes and pipes. Each tile's `extras` name its layer; those of the tileset hold
// the ids of map and run, and the storeys. With a page (`TilesOptions::page`) also index.html,
// which shows them. A map without points, lines and planes
// has none, which is logged.
class TilesWriter : public MapWriter {
 public:
  explicit TilesWriter(const TilesOptions& options) : options_(options) {}
  std::string Format() const override { return "tiles"; }
  std::vector<std::string> Names() const override { return {"tiles"}; }
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;

 private:
  const TilesOptions options_;
};

// Writes NAME/N.glb and returns the root of their tree: a tile holds the longest of its lines, its
// two children have the others on either side of the middle. The geometric error is the length of
// the longest line that is not there yet. Adds the paths to `paths`.
TileOfSet WriteLineTiles(const std::string& folder, const std::string& name, const MapResult& map,
                         std::vector<std::string>* paths, const Progress& progress = {});

}  // namespace slcmap::exporting
