#include "mapping/map_folder.h"

#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "data/error.h"
#include "data/file.h"
#include "data/json_file.h"
#include "data/ply.h"
#include "mapping/point_cloud.h"
#include "odometry/run_json.h"
#include "odometry/run_lines.h"

namespace slcmap {
namespace {

constexpr int kMapVersion = 1;

// The files of a map folder.
struct MapPaths {
  explicit MapPaths(const std::string& folder)
      : trajectory(folder + "/trajectory.tum"),
        keyframes(folder + "/keyframes.tum"),
        points(folder + "/points.ply"),
        cloud(folder + "/points.pcd"),
        lines(folder + "/lines.ply"),
        occupancy(folder + "/occupancy.bt"),
        rig(folder + "/rig.json"),
        summary(folder + "/map.json") {}
  std::string trajectory, keyframes, points, cloud, lines, occupancy, rig, summary;
};

double MedianObservations(const std::vector<MapLine>& lines) {
  std::vector<int> observations;
  for (const MapLine& line : lines) observations.push_back(line.observations);
  return LivesOf(std::move(observations)).median_keyframes;
}

void WriteSummary(const std::string& path, const MapResult& map) {
  WriteJsonFile(path, {{"format", "slcmap map"},
                       {"version", kMapVersion},
                       {"method", map.method},
                       {"complete", map.complete},
                       {"partial_reason", map.partial_reason},
                       {"warnings", Json(map.warnings)},
                       {"poses", map.trajectory.size()},
                       {"keyframes", map.keyframes.size()},
                       {"points", map.points.size()},
                       {"lines", map.lines.size()},
                       {"median_line_observations", MedianObservations(map.lines)},
                       {"occupied_voxels", map.occupancy.OccupiedVoxels().size()},
                       {"voxel_m", map.occupancy.resolution_m()}});
}

// The counts in the file tell an empty trajectory, which is no trajectory file, from a damaged one.
struct Counts {
  std::size_t poses = 0, keyframes = 0;
};

Counts ReadSummary(const std::string& path, MapResult* map) {
  return ParseJsonFile(path, [&](const Json& json) {
    CheckFormat(path, json, "slcmap map", kMapVersion, kMapVersion);
    map->method = json.at("method").get<std::string>();
    map->complete = json.at("complete").get<bool>();
    map->partial_reason = json.at("partial_reason").get<std::string>();
    map->warnings = json.at("warnings").get<std::map<std::string, int64_t>>();
    return Counts{json.at("poses").get<std::size_t>(), json.at("keyframes").get<std::size_t>()};
  });
}

Trajectory ReadPoses(const std::string& path, std::size_t count) {
  const Trajectory trajectory = count == 0 ? Trajectory() : ReadTumTrajectory(path);
  if (trajectory.size() != count) {
    throw DataError(fmt::format("{}: found {} poses, expected {} as in map.json", path,
                                trajectory.size(), count));
  }
  return trajectory;
}

void WritePoints(const std::string& path, const std::vector<MapPoint>& points) {
  PlyElement vertices{"vertex", {}};
  for (const char* name : {"x", "y", "z", "sigma_m"}) vertices.Add(name, PlyType::kFloat);
  vertices.Add("observations", PlyType::kInt32);
  for (const MapPoint& point : points) {
    vertices.AppendRow({point.p_world.x(), point.p_world.y(), point.p_world.z(), point.sigma_m,
                        static_cast<double>(point.observations)});
  }
  WritePly(path, {{"slcmap points, metres in the world frame"}, {vertices}, {}});
}

std::vector<MapPoint> ReadPoints(const std::string& path) {
  const PlyFile file = ReadPly(path);
  const PlyElement& vertices = file.Get("vertex", path);
  const std::vector<Eigen::Vector3d> positions = Positions(vertices, path);
  const std::vector<double>& sigma_m = vertices.Get("sigma_m", path).values;
  const std::vector<double>& observations = vertices.Get("observations", path).values;
  std::vector<MapPoint> points(vertices.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i] = {positions[i], sigma_m[i], static_cast<int>(observations[i]), {}};
  }
  return points;
}

}  // namespace

StageFiles MapFiles() {
  return {"a map",
          {"map.json", "trajectory.tum", "keyframes.tum", "points.ply", "points.pcd", "lines.ply",
           "occupancy.bt", "rig.json"}};
}

void WriteMapFolder(const std::string& folder, const MapResult& map) {
  OutputFolder output(folder, MapFiles());
  WriteMapFolder(&output, map);
}

void WriteMapFolder(OutputFolder* folder, const MapResult& map) {
  const MapPaths paths(folder->staging());
  WriteTumTrajectory(paths.trajectory, map.trajectory);
  WriteTumTrajectory(paths.keyframes, map.keyframes);
  WritePoints(paths.points, map.points);
  WritePcd(paths.cloud, map.points);
  WriteMapLines(paths.lines, map.lines);
  map.occupancy.Write(paths.occupancy);
  WriteRig(paths.rig, map.rectified_rig);
  WriteSummary(paths.summary, map);
  folder->Commit();
}

MapResult ReadMapFolder(const std::string& folder) {
  const InputLock lock(folder);
  const MapPaths paths(folder);
  MapResult map;
  const Counts counts = ReadSummary(paths.summary, &map);
  map.rectified_rig = ReadRig(paths.rig);
  map.trajectory = ReadPoses(paths.trajectory, counts.poses);
  map.keyframes = ReadPoses(paths.keyframes, counts.keyframes);
  map.points = ReadPoints(paths.points);
  map.lines = ReadMapLines(paths.lines);
  map.occupancy = OccupancyMap::Read(paths.occupancy);
  return map;
}

}  // namespace slcmap
