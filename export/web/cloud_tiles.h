// Parts of a tileset (OGC 3D Tiles 1.1): a cloud of points as an octree of GLB files with implicit
// tiling, and lines as a tree of them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "data/core/progress.h"
#include "data/io/json.h"
#include "export/scene/scene.h"

namespace slcmap::inline exporting {

// Parts of a map as GLB files of their own, as scene.glb has them.

struct PartModel {
  std::string bytes;
  Eigen::AlignedBox3d box;  // of its vertices, z up; empty of a part without any
};

// Throw OutputError.
PartModel MakePointsModel(const std::string& name, const Vertices& vertices);
PartModel MakeLinesModel(const MapResult& map, std::span<const std::size_t> lines);  // of these
PartModel MakeBuildingModel(const MapResult& map);  // walls, other planes and pipes

// Parts of a tileset (OGC 3D Tiles 1.1): a cloud of points as an octree of GLB files with implicit
// tiling, and lines as a tree of them.

// Points that are asked for one by one, in any order, so that they need not be in memory in one
// piece. Metres, z up.
struct PointsToTile {
  std::string name;  // of the folder that its files are in, such as "dense"
  std::size_t count = 0;
  std::function<Eigen::Vector3d(std::size_t)> position;
  std::function<Colour(std::size_t)> colour;
};

// A tile of a tileset, and what its content and that of its children lies in.
struct TileOfSet {
  Json json;
  Eigen::AlignedBox3d box;
};

// Writes NAME/{level}_{x}_{y}_{z}.glb and .subtree into a folder, adds their paths to `paths`, and
// returns the root of the octree. Each point is in one tile: a tile has one point a cell of a grid
// of 128 cells across its cube, and its children have what is left (refinement by adding). What is
// left is kept whole where it is little. In a file each beginning is spread over the whole tile, so
// that viewers may draw a part. The geometric error is four times the grid's spacing: where 16
// pixels of error are allowed, points are at most 4 pixels apart. Memory: 16 bytes a point and one
// tile. Throws DataError for coordinates that are not finite, OutputError, and StoppedError when
// progress says so.
TileOfSet WriteCloudTiles(const std::string& folder, const PointsToTile& points,
                          std::vector<std::string>* paths, const Progress& progress = {});

// Writes NAME/N.glb and returns the root of their tree: a tile holds the longest of its lines, its
// two children have the others on either side of the middle. The geometric error is the length of
// the longest line that is not there yet. Adds the paths to `paths`.
TileOfSet WriteLineTiles(const std::string& folder, const std::string& name, const MapResult& map,
                         std::vector<std::string>* paths, const Progress& progress = {});

// Of cells of 21 bits an axis: neighbours in space mostly are neighbours in it.
uint64_t MortonCode(uint64_t x, uint64_t y, uint64_t z);

// A box as 3D Tiles have it: its centre and half its extent along each axis.
Json BoundingVolume(const Eigen::AlignedBox3d& box);

}  // namespace slcmap::exporting
