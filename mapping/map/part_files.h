// Files and parts of files of a map folder: the dense cloud, pipes.json, and the runs of a merged
// map in map.json. Include in .cc files only: the JSON parser is a large header.
#pragma once

#include <string>
#include <vector>

#include "data/io/json.h"
#include "data/io/ply.h"
#include "mapping/map/map.h"

namespace slcmap::inline mapping {

// A PLY file: `x y z nx ny nz sigma_m` (float), `red green blue grey` (uchar, all four the grey of
// the image) and `source` (int: 0 stereo, 1 filled plane), with a comment where there is one. The
// map's measured points, then those that were filled. Throws OutputError.
void WriteDensePly(const std::string& path, const MapResult& map, PlyForm form = PlyForm::kBinary,
                   const std::string& comment = "");

// Reads what WriteDensePly wrote of a map. Throws DataError naming file and row.
void ReadDensePly(const std::string& path, MapResult* map);

// The same as a PCD file, with `normal_x normal_y normal_z` and `intensity` as PCL names them.
void WriteDensePcd(const std::string& path, const MapResult& map);

inline constexpr char kPipeFile[] = "pipes.json";

// A list of pipes with what MapPipe holds under its names, the axis by name. Throws OutputError.
void WritePipes(const std::string& path, const std::vector<MapPipe>& pipes);

// Throws DataError naming the file, the pipe and the key for values that cannot be.
std::vector<MapPipe> ReadPipes(const std::string& path);

inline constexpr char kPatternFile[] = "patterns.json";

// A list of patterns with what MapPattern holds under its names. Throws OutputError.
void WritePatterns(const std::string& path, const std::vector<MapPattern>& patterns);

// Throws DataError naming the file, the pattern and the key for values that cannot be.
std::vector<MapPattern> ReadPatterns(const std::string& path);

Json MergedJson(const std::vector<MergedRun>& runs);

// Throws DataError, naming the path and the run, for less than two runs, one that is there twice,
// a first one that is not where it was or not that of the map's source, and values that cannot be.
std::vector<MergedRun> ParseMerged(const std::string& path, const Json& json,
                                   const MapSource& source);

// How a run's world is turned in the map's, about z: yaw_rad of an object, and back.
double YawOfWorld(const RigidTransform& T_world_run);
RigidTransform ParseTurn(const std::string& place, const Json& json);

// The object `georeference`; null where there is none.
Json GeoreferenceJson(const std::optional<Georeference>& georeference);

// That of an object: its key `georeference`; nothing where that is null. Throws DataError.
std::optional<Georeference> ParseGeoreference(const std::string& place, const Json& json);

// The same place of the frame that T brings the map to.
std::optional<Georeference> MoveGeoreference(const std::optional<Georeference>& georeference,
                                             const RigidTransform& T_moved_map);

// Throws DataError, naming the path, where it is known from when to when each run has poses and the
// map has one besides.
void CheckPosesOfRuns(const std::string& path, const MapResult& map);

}  // namespace slcmap::mapping
