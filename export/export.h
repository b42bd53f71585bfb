// From a map to files that other programs show, in a frame along the building.
#pragma once

#include <string>
#include <vector>

#include "data/core/progress.h"
#include "data/io/output_folder.h"
#include "export/scene/options.h"
#include "export/scene/scene.h"
#include "mapping/map/map.h"

namespace slcmap::inline exporting {

struct ExportOptions {
  std::vector<std::string> formats;  // empty: all there are
  int max_vertices = kMostVertices;  // of what is drawn of a map
  PlanOptions plan;
  GltfOptions gltf;
  GridOptions grid;
  bool ascii_ply = false;           // text, for scripts; up to two and a half times as large
  bool ifc_line_solids = false;     // lines as thin solids too: viewers often hide annotations
  std::string obj_up = "z";         // or "y", as many programs of modelling and games have it
  std::string las_version = "1.2";  // or "1.4"
  std::string tiles_page;           // the bundle of the page that shows them; "" for none
  std::string colmap_images;        // "": none, "rectified": as the model's cameras have them
  RecordingOptions recording;
};

// The names of the formats there are.
std::vector<std::string> ExportFormats();

// Throws ConfigError for a format that there is not, and for options that cannot be.
void CheckFormats(const ExportOptions& options);

// The names of the files of an export in all formats.
StageFiles ExportFiles();

// The run that the map of an export was made of, and how it is turned, by its summary. Throws
// DataError.
MapSource ExportSourceIn(const std::string& folder);

// Writes a map into a folder, which is made where it is missing, and returns the files' paths, but
// those of COLMAP's images and of the content of tiles. The frame of all is along the building
// (FrameOfExports), and the summary says how the run
// (`yaw_rad`) and the map's world (`map_yaw_rad`) are turned in it. The files of an earlier export
// are replaced once all are written. Throws ConfigError for a format
// that there is not, a map that is too large (max_vertices) or files of others in
// folders that are written anew, OutputError naming the
// file that cannot be written, StoppedError when progress says so, and what OutputFolder throws;
// the files of an earlier export then stay as they were.
std::vector<std::string> ExportMap(const MapResult& map, const std::string& folder,
                                   const ExportOptions& options, const Progress& progress = {});
std::vector<std::string> ExportMap(const MapResult& map, OutputFolder* folder,
                                   const ExportOptions& options, const Progress& progress = {});

// The frame of exports: along the building, the same in all formats.

// From the map's world to the frame of exports: a turn about z that lays the main heading of the
// walls (Building::T_map_world) along x or y, whichever is nearer, by at most 45 degrees.
// None for maps that are only shifted (IsShiftedOnly): they keep the axes of a frame that others
// share.
RigidTransform FrameOfExports(const MapResult& map);

// Whether it is there already.
bool IsInFrameOfExports(const Building& building);

// The map in the frame of exports, in which Building::T_map_world is none; MapSource says how its
// runs are turned there. Occupancy is sampled anew: a voxel is what the map has at its centre.
// Throws StoppedError when progress says so.
MapResult InFrameOfExports(const MapResult& map, const Progress& progress);

}  // namespace slcmap::exporting
