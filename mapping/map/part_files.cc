#include "mapping/map/part_files.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "data/io/file.h"
#include "data/io/json.h"
#include "data/io/json_fields.h"
#include "data/source/sequence_options_json.h"
#include "odometry/run/run_rows.h"

namespace slcmap::inline mapping {
void WriteDensePly(const std::string& path, const MapResult& map, PlyForm form,
                   const std::string& comment) {
  PlyElement vertices{"vertex", {}};
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "sigma_m"}) {
    vertices.Add(name, PlyType::kFloat);
  }
  // Viewers colour a cloud by red, green and blue alone.
  for (const char* name : {"red", "green", "blue", "grey"}) vertices.Add(name, PlyType::kUint8);
  vertices.Add("source", PlyType::kInt32);
  vertices.Reserve(CountDense(map));
  for (std::size_t i = 0; i < CountDense(map); ++i) {
    const DensePoint& point = DenseAt(map, i);
    const Eigen::Vector3d &p = point.p_world, &n = point.normal_world;
    const double grey = point.grey;
    vertices.AppendRow({p.x(), p.y(), p.z(), n.x(), n.y(), n.z(), point.sigma_m, grey, grey, grey,
                        grey, IsFilled(map, i) ? 1.0 : 0.0});
  }
  PlyFile file{{"slcmap dense points, metres in the world frame"}, {}, {}};
  if (!comment.empty()) file.comments.push_back(comment);
  file.elements.push_back(std::move(vertices));  // a list of elements would copy it
  WritePly(path, file, form);
}

void ReadDensePly(const std::string& path, MapResult* map) {
  const PlyFile file = ReadPly(path);
  const PlyElement& vertices = file.Get("vertex", path);
  const auto bounded = [&](const char* name, double least, double most) {
    return vertices.Bounded(name, least, most, path);
  };
  const auto coordinate = [&](const char* name) {
    return bounded(name, -kMaxCoordinate_m, kMaxCoordinate_m);
  };
  const std::vector<double> x = coordinate("x"), y = coordinate("y"), z = coordinate("z");
  const std::vector<double> nx = bounded("nx", -1, 1), ny = bounded("ny", -1, 1),
                            nz = bounded("nz", -1, 1);
  const std::vector<double> sigma_m = bounded("sigma_m", 0, kMaxSigma_m);
  const std::vector<double> grey = bounded("grey", 0, 255), source = bounded("source", 0, 1);
  map->dense.clear();
  map->filled.clear();
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    (source[i] == 1 ? map->filled : map->dense)
        .push_back(
            {{x[i], y[i], z[i]}, {nx[i], ny[i], nz[i]}, sigma_m[i], static_cast<uint8_t>(grey[i])});
  }
}

void WriteDensePcd(const std::string& path, const MapResult& map) {
  std::string bytes = fmt::format(
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n"
      "FIELDS x y z normal_x normal_y normal_z intensity sigma_m source\n"
      "SIZE 4 4 4 4 4 4 4 4 4\nTYPE F F F F F F F F I\nCOUNT 1 1 1 1 1 1 1 1 1\n"
      "WIDTH {0}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA binary\n",
      CountDense(map));
  FileWriter file(path);
  for (std::size_t i = 0; i < CountDense(map); ++i) {
    const DensePoint& point = DenseAt(map, i);
    for (const double value : point.p_world) AppendBytes(static_cast<float>(value), &bytes);
    for (const double value : point.normal_world) AppendBytes(static_cast<float>(value), &bytes);
    AppendBytes(static_cast<float>(point.grey), &bytes);
    AppendBytes(static_cast<float>(point.sigma_m), &bytes);
    AppendBytes<int32_t>(IsFilled(map, i) ? 1 : 0, &bytes);
    file.Add(bytes);
    bytes.clear();
  }
  file.Add(bytes);
  file.Close();
}

namespace {

constexpr std::array<const char*, 5> kAxisNames = {"x", "y", "vertical", "none", "sloped"};
constexpr double kMostRadius_m = 1e3, kLeastRadius_m = 1e-4;
constexpr int kMostWorld = 1'000'000, kMostImages = 1'000'000'000;

// Written as slcmap writes them: ids count from 0.
template <typename Thing>
std::vector<Thing> ReadList(const std::string& path, const char* what) {
  return ParseJsonFile(path, [&](const Json& json) {
    if (!json.is_array()) {
      throw DataError(fmt::format("{}: found no list, expected a list of {}s", path, what));
    }
    std::vector<Thing> things = JsonReader::ReadList<Thing>(path, json);
    for (size_t i = 0; i < things.size(); ++i) {
      if (things[i].id == static_cast<int64_t>(i)) continue;
      throw DataError(fmt::format("{}: {} {}: found it at place {}, expected ids to count from 0",
                                  path, what, things[i].id, i));
    }
    return things;
  });
}

}  // namespace

// A hundredth of a millimetre is too coarse for what says how well something is known.
template <typename Fields>
void Describe(Fields& fields, Of<MapPipe> auto& pipe) {
  fields.Integer("id", pipe.id, 0, static_cast<int64_t>(kMaxId));
  fields.Place("pipe", pipe.id);
  fields.Integer("segment", pipe.segment, 0, static_cast<int64_t>(kMaxSegment));
  fields.Named("axis", pipe.axis, kAxisNames);
  fields.Integer("world", pipe.world, -1, kMostWorld);
  fields.Point("start", pipe.start_world, kMaxCoordinate_m);
  fields.Point("end", pipe.end_world, kMaxCoordinate_m);
  fields.Number("radius_m", pipe.radius_m, kLeastRadius_m, kMostRadius_m);
  fields.Number("sigma_m", pipe.sigma_m, 0, kMaxSigma_m, kMicrometres);
  fields.Number("radius_sigma_m", pipe.radius_sigma_m, 0, kMaxSigma_m, kMicrometres);
  fields.Integer("images", pipe.images, 0, kMostImages);
}

template <typename Fields>
void Describe(Fields& fields, Of<MapPattern> auto& pattern) {
  constexpr double kUnitSlack = 1e-4, kMostDistance_m = 10;  // of a pattern's lines
  fields.Integer("id", pattern.id, 0, static_cast<int64_t>(kMaxId));
  fields.Place("pattern", pattern.id);
  fields.Integer("segment", pattern.segment, 0, static_cast<int64_t>(kMaxSegment));
  fields.Point("origin", pattern.origin_world, kMaxCoordinate_m);
  fields.Unit("direction", pattern.direction_world, kUnitSlack, kMicrometres);
  fields.Unit("across", pattern.across_world, kUnitSlack, kMicrometres);
  fields.Number("spacing_m", pattern.spacing_m, 1e-6, kMostDistance_m, kMicrometres);
  fields.Number("scatter_m", pattern.scatter_m, 0, kMostDistance_m, kMicrometres);
  fields.Range("along_m", pattern.along_m, kMaxCoordinate_m);
  fields.Range("across_m", pattern.across_m, kMaxCoordinate_m);
  fields.Value("lines", pattern.line_ids);
}

void WritePipes(const std::string& path, const std::vector<MapPipe>& pipes) {
  WriteJsonFile(path, JsonWriter::WriteList(pipes));
}

std::vector<MapPipe> ReadPipes(const std::string& path) {
  std::vector<MapPipe> pipes = ReadList<MapPipe>(path, "pipe");
  for (const MapPipe& pipe : pipes) {
    if (pipe.start_world != pipe.end_world) continue;
    throw DataError(fmt::format("{}: pipe {}: found an end that is its start, expected a length",
                                path, pipe.id));
  }
  return pipes;
}

void WritePatterns(const std::string& path, const std::vector<MapPattern>& patterns) {
  WriteJsonFile(path, JsonWriter::WriteList(patterns));
}

std::vector<MapPattern> ReadPatterns(const std::string& path) {
  return ReadList<MapPattern>(path, "pattern");
}

namespace {

constexpr double kMostYaw_rad = 4;

std::optional<StampSpan> ParsePoses(const std::string& place, const Json& json) {
  if (!json.contains("first_pose_ns") && !json.contains("last_pose_ns")) return std::nullopt;
  StampSpan span;
  span.from_ns = BoundedAt(place, json, "first_pose_ns", -kMaxStamp_ns, kMaxStamp_ns);
  span.to_ns = BoundedAt(place, json, "last_pose_ns", span.from_ns, kMaxStamp_ns);
  return span;
}

MergedRun ParseMergedRun(const std::string& place, const Json& json) {
  MergedRun run;
  run.run_id = json.at("run").get<std::string>();
  run.sequence = json.at("sequence").get<std::string>();
  run.opened = ParseOpened(json);
  run.version = json.at("slcmap").get<std::string>();
  run.stamps_moved_ns = BoundedAt(place, json, "stamps_moved_ns", -kMaxStamp_ns, kMaxStamp_ns);
  run.poses_ns = ParsePoses(place, json);
  const auto p =
      ParsePoint<Eigen::Vector3d>(place + ": position_m", json.at("position_m"), kMaxCoordinate_m);
  run.T_world_run = {ParseTurn(place, json).rotation, p};
  run.date = json.value("date", "");
  return run;
}

// The map's world and stamps are those of its first run's map.
void CheckFirst(const std::string& place, const MergedRun& run, const MapSource& source) {
  if (run.run_id != source.run_id) {
    throw DataError(fmt::format("{}: run: found '{}', expected '{}' as in source", place,
                                run.run_id, source.run_id));
  }
  const RigidTransform moved = source.T_world_run.Inverse() * run.T_world_run;
  if (run.stamps_moved_ns == 0 && moved.translation.isZero() &&
      LogRotation(moved.rotation).isZero()) {
    return;
  }
  throw DataError(place + ": found it moved, expected the first run as it was");
}

bool HoldTheSame(const StampSpan& a, const StampSpan& b) {
  return a.from_ns <= b.to_ns && b.from_ns <= a.to_ns;
}

void CheckAgainst(const std::string& place, const MergedRun& run, const MergedRun& before) {
  if (!run.run_id.empty() && run.run_id == before.run_id) {
    throw DataError(fmt::format("{}: run: found {} twice, expected each once", place, run.run_id));
  }
  if (run.poses_ns && before.poses_ns && HoldTheSame(*run.poses_ns, *before.poses_ns)) {
    throw DataError(
        fmt::format("{}: found poses from {} to {} ns, expected none among those of run {}", place,
                    run.poses_ns->from_ns, run.poses_ns->to_ns, before.run_id));
  }
}

}  // namespace

double YawOfWorld(const RigidTransform& T_world_run) {
  return LogRotation(T_world_run.rotation).z();
}

Json GeoreferenceJson(const std::optional<Georeference>& georeference) {
  if (!georeference) return nullptr;
  const Eigen::Vector3d& p = georeference->origin_m;
  return {{"crs", georeference->crs},
          {"origin_m", {p.x(), p.y(), p.z()}},
          {"turn_rad", georeference->turn_rad},
          {"scale", georeference->scale}};
}

std::optional<Georeference> ParseGeoreference(const std::string& place, const Json& json) {
  constexpr double kMostOffset_m = 1e10;  // beyond the Earth
  const Json& found = json.at("georeference");
  if (found.is_null()) return std::nullopt;
  Georeference georeference;
  georeference.crs = NameOfSystem(found.at("crs").get<std::string>());
  georeference.origin_m =
      ParsePoint<Eigen::Vector3d>(place + ": origin_m", found.at("origin_m"), kMostOffset_m);
  georeference.turn_rad = BoundedAt(place, found, "turn_rad", -kMostYaw_rad, kMostYaw_rad);
  georeference.scale = BoundedAt(place, found, "scale", 0.5, 2.0);
  return georeference;
}

std::optional<Georeference> MoveGeoreference(const std::optional<Georeference>& georeference,
                                             const RigidTransform& T_moved_map) {
  if (!georeference) return std::nullopt;
  Georeference moved = *georeference;
  moved.origin_m = *georeference * T_moved_map.Inverse().translation;
  moved.turn_rad = std::remainder(georeference->turn_rad - YawOfWorld(T_moved_map), 2 * M_PI);
  return moved;
}

RigidTransform ParseTurn(const std::string& place, const Json& json) {
  const double yaw_rad = BoundedAt(place, json, "yaw_rad", -kMostYaw_rad, kMostYaw_rad);
  return {ExpRotation({0, 0, yaw_rad}), Eigen::Vector3d::Zero()};
}

Json MergedJson(const std::vector<MergedRun>& runs) {
  Json json = Json::array();
  for (const MergedRun& run : runs) {
    const Eigen::Vector3d& p = run.T_world_run.translation;
    Json& item = json.emplace_back(Json{{"run", run.run_id},
                                        {"slcmap", run.version},
                                        {"sequence", run.sequence},
                                        {"opened", OpenedJson(run.opened)},
                                        {"stamps_moved_ns", run.stamps_moved_ns}});
    if (run.poses_ns) item["first_pose_ns"] = run.poses_ns->from_ns;
    if (run.poses_ns) item["last_pose_ns"] = run.poses_ns->to_ns;
    item["position_m"] = {p.x(), p.y(), p.z()};
    item["yaw_rad"] = YawOfWorld(run.T_world_run);
    if (!run.date.empty()) item["date"] = run.date;
  }
  return json;
}

std::vector<MergedRun> ParseMerged(const std::string& path, const Json& json,
                                   const MapSource& source) {
  if (!json.is_array() || json.size() < 2) {
    throw DataError(fmt::format("{}: merged: found {}, expected a list of two runs or more", path,
                                json.is_array() ? fmt::format("{} runs", json.size())
                                                : fmt::format("'{}'", json.type_name())));
  }
  std::vector<MergedRun> runs;
  for (const Json& item : json) {
    const std::string place = fmt::format("{}: merged: run {}", path, runs.size());
    const MergedRun run = ParseMergedRun(place, item);
    if (runs.empty()) CheckFirst(place, run, source);
    for (const MergedRun& before : runs) CheckAgainst(place, run, before);
    runs.push_back(run);
  }
  return runs;
}

void CheckPosesOfRuns(const std::string& path, const MapResult& map) {
  const std::vector<MergedRun>& runs = map.source.merged;
  const bool are_known =
      std::ranges::all_of(runs, &std::optional<StampSpan>::has_value, &MergedRun::poses_ns);
  if (runs.empty() || !are_known) return;
  for (const Trajectory* poses : {&map.trajectory, &map.keyframes}) {
    for (const StampedPose& pose : *poses) {
      const auto holds = [&](const MergedRun& run) {
        return HoldTheSame(*run.poses_ns, {pose.stamp_ns, pose.stamp_ns});
      };
      if (std::ranges::any_of(runs, holds)) continue;
      throw DataError(
          fmt::format("{}: merged: found a pose at {} ns that is none of any run's, "
                      "expected it from first_pose_ns to last_pose_ns of one",
                      path, pose.stamp_ns));
    }
  }
}

}  // namespace slcmap::mapping
