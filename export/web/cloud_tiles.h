// A cloud of points as an octree of GLB files with implicit tiling (OGC 3D Tiles 1.1).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "data/core/progress.h"
#include "data/io/json.h"
#include "export/scene/scene.h"

namespace slcmap::inline exporting {

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

// A box as 3D Tiles have it: its centre and half its extent along each axis.
Json BoundingVolume(const Eigen::AlignedBox3d& box);

}  // namespace slcmap::exporting
