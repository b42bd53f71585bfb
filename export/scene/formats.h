// The formats that a map is written in, one a function: each writes files into an existing folder
// and returns their paths. They throw OutputError, StoppedError when progress says so, and what is
// said below. Options that cannot be are refused before (CheckFormats in export/export.h).
//
// Maps are in the frame of exports: the building's T_map_world is none.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "data/core/progress.h"
#include "export/scene/options.h"
#include "export/scene/plane_canvas.h"
#include "export/scene/scene.h"
#include "mapping/map/map.h"

namespace slcmap::inline exporting {

struct MapFormat {
  std::string name;  // as on the command line, such as "dxf"
  std::vector<std::string>
      files;  // all that it may write: names of files, and of folders of its own
  std::function<std::vector<std::string>(const std::string& folder, const MapResult& map,
                                         const Progress& progress)>
      write;
  // False: only where it is asked for by its name, as it needs more than the map.
  bool is_written_by_default = true;
};

// Points, lines and triangles: scene/, web/.

// A PLY file a layer of the scene: coloured vertices, and edges (vertex1, vertex2) or triangles
// between them. Empty layers are written too, so that no file of an earlier export is left.
std::vector<std::string> WriteScenePly(bool ascii, const std::shared_ptr<SceneOfMap>& scene_of_map,
                                       const std::string& folder, const MapResult& map,
                                       const Progress& progress = {});

// points.pcd, dense.pcd, dense.ply and occupancy.bt, as a map folder holds them, but dense.ply in
// the form that is asked for.
std::vector<std::string> WriteClouds(bool ascii, const std::string& folder, const MapResult& map,
                                     const Progress& progress = {});

// scene.glb under a root node that turns z up into glTF's y up: the points, the dense cloud, the
// lines by storey and axis, trajectory, keyframes and, on request, voxels, walls as solids that
// meet at corners, with their openings, and other planes by kind, with ids, kinds and what is known
// of each in `extras`. Materials are unlit (KHR_materials_unlit) and colours are vertex colours of
// 8 bits. Empty layers are left out. With what the scene has, there are at most max_vertices: dense
// points beyond are thinned. `textures`, where there are some, become the layer "orthophotos", just
// before the walls and floors that they are of.
std::vector<std::string> WriteGlb(const GltfOptions& options, int max_vertices,
                                  const std::shared_ptr<SceneOfMap>& scene_of_map,
                                  const std::shared_ptr<std::vector<FaceTexture>>& textures,
                                  const std::string& folder, const MapResult& map,
                                  const Progress& progress = {});

// tiles/tileset.json: the clouds "dense", "filled" and "points" as octrees with implicit tiling
// (cloud_tiles.h), lines as a tree of GLB files, the longest first, and of each storey its walls,
// other planes and pipes. Each tile's `extras` name its layer; those of the tileset hold the ids of
// map and run, and the storeys. With a page, the bundle that shows them, also index.html. A map
// without points, lines and planes has none, which is logged.
std::vector<std::string> WriteTiles(const std::string& page, const std::string& folder,
                                    const MapResult& map, const Progress& progress = {});

// Plans, sections and elevations: plan/.

// plan/NAME.svg for each sheet.
std::vector<std::string> WriteSvgPlans(const PlanOptions& options, const std::string& folder,
                                       const MapResult& map, const Progress& progress = {});

// plan.pdf with a page for each plan, in its size, by cairo, and plan/NAME.pdf for each section and
// elevation.
std::vector<std::string> WritePdfPlans(const PlanOptions& options, const std::string& folder,
                                       const MapResult& map, const Progress& progress = {});

// grid/storey_N.pgm and storey_N.yaml for each storey, as ROS' map_server reads them: a cell is
// occupied (0) where a voxel of the occupancy map is within a band of heights over the storey's
// floor, else free (254) where one is, else unknown (205). Row 0 is at the top, the largest y. Of a
// map without storeys one, `grid/no_storey`, over its lowest voxel. Throws DataError for a map that
// is too large.
std::vector<std::string> WriteGrids(const GridOptions& options, const std::string& folder,
                                    const MapResult& map, const Progress& progress = {});

// Drawing, building information and modelling: cad/.

// plan.dxf, the plans of all storeys at z = 0 (those above the lowest on layers that are off; where
// there are several, each is in plan/storey_N.dxf by itself too), sections and elevations as
// plan/NAME.dxf, upright in x and y, and map.dxf, the map in space: lines by storey, axis and kind,
// points, planes, trajectory. All in metres, in the form of AutoCAD R12, which all programs read.
std::vector<std::string> WriteDxf(const PlanOptions& options, const std::string& folder,
                                  const MapResult& map, const Progress& progress = {});

// map.obj, in metres, z or y up: an object (`o`) a layer of map_layers.h, lines, outlines and the
// trajectory as line elements (`l`) of two vertices each, planes as triangles (`f`); and map.mtl
// with a colour for each kind of plane, axis of lines and the trajectory.
std::vector<std::string> WriteObj(const std::string& up, const std::string& folder,
                                  const MapResult& map, const Progress& progress = {});

// map.ifc, IFC4: project, site, building, storeys; walls with openings and doors, slabs, spaces,
// pipes, and lines as annotations, on request also as thin solids. Metres, in the map's world;
// without a compass there is no true north. What cannot be a solid is left out, with a warning that
// counts it. Throws DataError for a map with numbers that are not finite.
std::vector<std::string> WriteIfc(bool line_solids, const std::string& folder, const MapResult& map,
                                  const Progress& progress = {});

// Those who go on elsewhere: sfm/, ortho/.

// colmap/cameras.txt, images.txt and points3D.txt: the rectified cameras as PINHOLE, both images of
// each keyframe, and of each view between them that shows a line, with its pose and the points that
// it shows (ModelImages, ModelPoints), and the points with their tracks. A map does not hold
// colours of points: they are grey. Images as recorded have to be rectified first: where `images`
// is "rectified" they are written so under colmap/images, by their names in images.txt. A map
// without calibrated cameras has points alone.
std::vector<std::string> WriteColmap(const std::string& images, const RecordingOptions& recording,
                                     const std::string& folder, const MapResult& map,
                                     const Progress& progress = {});

// The pieces of lines twice: limap/alltracks.txt, as limap saves its tracks (their number; of each
// its id and counts, start, end, ids of images, numbers of its segments there), and
// limap/lines.txt, a row a piece with its segments, as Line3D++ has them and limap reads them.
// Images are those of COLMAP's model (ModelImages), pixels too.
std::vector<std::string> WriteLimap(const std::string& folder, const MapResult& map,
                                    const Progress& progress = {});

// ortho/NAME.png for each face that some keyframe's image saw (ListFaces), with alpha 0 where none
// did, ortho/NAME.pgw, its world file, and ortho/orthophotos.json, which says where they lie in the
// frame of exports. The same images, as fine as textures should be, are added to `textures`. Throws
// DataError where the recording is missing, or has none of the images that were chosen.
std::vector<std::string> WriteOrtho(const RecordingOptions& recording,
                                    const std::shared_ptr<std::vector<FaceTexture>>& textures,
                                    const std::string& folder, const MapResult& map,
                                    const Progress& progress = {});

// Surveyors and geographic information systems: survey/. Coordinates are those of the map's place
// (FindPlace), in metres where nothing else is said.

// cloud.las of a version, 1.2 or 1.4: surfaces that were measured, then those that were derived,
// then landmarks. Clouds of more than 2^32 - 1 points are always 1.4. Throws DataError for points
// that are not finite or too far apart.
std::vector<std::string> WriteLas(const std::string& version, const std::string& folder,
                                  const MapResult& map, const Progress& progress = {});

// cloud.e57: a scan (Data3D) each for surfaces that were measured, those that were derived, and
// landmarks, where there are any. Throws DataError for points that are not finite.
std::vector<std::string> WriteE57(const std::string& folder, const MapResult& map,
                                  const Progress& progress = {});

// plan.gpkg, a GeoPackage with the layers of MakeFeatureLayers, for all storeys, in the CRS of the
// map or an engineering one.
std::vector<std::string> WriteGeoPackage(const std::string& folder, const MapResult& map,
                                         const Progress& progress = {});

// plan/storey_N.geojson for each storey with the features of MakeFeatureLayers, each of which says
// in `feature` what it is; of a map without storeys one, `plan/no_storey`. Coordinates are degrees
// of WGS 84, or metres of a map that has no place on Earth: then `crs` says so. Throws DataError
// for a map that is not where its system is.
std::vector<std::string> WriteGeoJson(const std::string& folder, const MapResult& map,
                                      const Progress& progress = {});

}  // namespace slcmap::exporting
