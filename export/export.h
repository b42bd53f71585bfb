// From a map to files that other programs show.
#pragma once

#include <string>
#include <vector>

#include "data/output_folder.h"
#include "data/progress.h"
#include "export/colmap_options.h"
#include "export/gltf_options.h"
#include "export/grid_options.h"
#include "export/ifc/ifc_options.h"
#include "export/obj_options.h"
#include "export/plan/plan_options.h"
#include "export/ply_options.h"
#include "export/scene.h"
#include "mapping/map.h"

namespace slcmap {

struct ExportOptions {
  std::vector<std::string> formats;  // empty: all there are
  SceneOptions scene;
  PlanOptions plan;
  GltfOptions gltf;
  PlyOptions ply;
  IfcOptions ifc;
  ObjOptions obj;
  ColmapOptions colmap;
  GridOptions grid;
};

// The names of the formats there are.
std::vector<std::string> ExportFormats();

// Throws ConfigError for a format that there is not, and for options of plans that cannot be.
void CheckFormats(const ExportOptions& options);

// The names of the files of an export in all formats.
StageFiles ExportFiles();

// The run that the map of an export was made of, and how it is turned, by its summary. Throws
// DataError.
MapSource ExportSourceIn(const std::string& folder);

// Writes a map into a folder, which is made where it is missing, and returns the files' paths, but
// those of COLMAP's images. The frame of all is along the building (building_frame.h), and the
// summary says how the run
// (`yaw_rad`) and the map's world (`map_yaw_rad`) are turned in it. The files of an earlier export
// are replaced once all are written. Throws ConfigError for a format
// that there is not, a map that is too large (SceneOptions::max_vertices) or files of others in
// folders that are written anew, OutputError naming the
// file that cannot be written, StoppedError when progress says so, and what OutputFolder throws;
// the files of an earlier export then stay as they were.
std::vector<std::string> ExportMap(const MapResult& map, const std::string& folder,
                                   const ExportOptions& options, const Progress& progress = {});
std::vector<std::string> ExportMap(const MapResult& map, OutputFolder* folder,
                                   const ExportOptions& options, const Progress& progress = {});

}  // namespace slcmap
