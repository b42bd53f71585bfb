#include "mapping/map/part_files.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "data/io/file.h"
#include "data/io/json.h"
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

LineAxis ParseAxis(const std::string& place, const Json& json) {
  const auto found = json.at("axis").get<std::string>();
  for (size_t i = 0; i < kAxisNames.size(); ++i) {
    if (found == kAxisNames[i]) return static_cast<LineAxis>(i);
  }
  throw DataError(fmt::format("{}: axis: found '{}', expected one of: x, y, vertical, none, sloped",
                              place, found));
}

// A hundredth of a millimetre is too coarse for what says how well something is known.
double Micrometres(double value_m) { return std::round(value_m * 1e6) / 1e6; }

Json PipeJson(const MapPipe& pipe) {
  return {{"id", pipe.id},
          {"segment", pipe.segment},
          {"axis", kAxisNames[static_cast<size_t>(pipe.axis)]},
          {"world", pipe.world},
          {"start", PointJson(pipe.start_world)},
          {"end", PointJson(pipe.end_world)},
          {"radius_m", RoundedForJson(pipe.radius_m)},
          {"sigma_m", Micrometres(pipe.sigma_m)},
          {"radius_sigma_m", Micrometres(pipe.radius_sigma_m)},
          {"images", pipe.images}};
}

MapPipe ParsePipe(const std::string& path, const Json& json, size_t index) {
  MapPipe pipe;
  pipe.id = BoundedAt<int64_t>(path, json, "id", 0, static_cast<int64_t>(kMaxId));
  const std::string place = fmt::format("{}: pipe {}", path, pipe.id);
  if (pipe.id != static_cast<int64_t>(index)) {
    throw DataError(
        fmt::format("{}: found it at place {}, expected ids to count from 0", place, index));
  }
  pipe.segment = BoundedAt(place, json, "segment", 0, static_cast<int>(kMaxSegment));
  pipe.axis = ParseAxis(place, json);
  pipe.world = BoundedAt(place, json, "world", -1, kMostWorld);
  pipe.start_world = ParsePoint<Eigen::Vector3d>(place, json.at("start"), kMaxCoordinate_m);
  pipe.end_world = ParsePoint<Eigen::Vector3d>(place, json.at("end"), kMaxCoordinate_m);
  if (pipe.start_world == pipe.end_world) {
    throw DataError(place + ": found an end that is its start, expected a length");
  }
  pipe.radius_m = BoundedAt(place, json, "radius_m", kLeastRadius_m, kMostRadius_m);
  pipe.sigma_m = BoundedAt(place, json, "sigma_m", 0.0, kMaxSigma_m);
  pipe.radius_sigma_m = BoundedAt(place, json, "radius_sigma_m", 0.0, kMaxSigma_m);
  pipe.images = BoundedAt(place, json, "images", 0, kMostImages);
  return pipe;
}

}  // namespace

void WritePipes(const std::string& path, const std::vector<MapPipe>& pipes) {
  Json json = Json::array();
  for (const MapPipe& pipe : pipes) json.push_back(PipeJson(pipe));
  WriteJsonFile(path, json);
}

std::vector<MapPipe> ReadPipes(const std::string& path) {
  return ParseJsonFile(path, [&](const Json& json) {
    if (!json.is_array()) throw DataError(path + ": found no list, expected a list of pipes");
    std::vector<MapPipe> pipes;
    for (const Json& pipe : json) pipes.push_back(ParsePipe(path, pipe, pipes.size()));
    return pipes;
  });
}

namespace {

constexpr double kMostDistance_m = 10;  // of a pattern's lines
constexpr double kUnitSlack = 1e-4;

Json IntervalJson(const Interval& interval) {
  return {RoundedForJson(interval.from_m), RoundedForJson(interval.to_m)};
}

Interval ParseInterval(const std::string& place, const Json& json, const char* key) {
  const auto ends = ParsePoint<Eigen::Vector2d>(place, json.at(key), kMaxCoordinate_m);
  if (ends.x() <= ends.y()) return {ends.x(), ends.y()};
  throw DataError(fmt::format("{}: {}: found {} to {}, expected the lesser first", place, key,
                              ends.x(), ends.y()));
}

Eigen::Vector3d ParseUnit(const std::string& place, const Json& json, const char* key) {
  const auto unit = ParsePoint<Eigen::Vector3d>(place, json.at(key), 1 + kUnitSlack);
  if (std::abs(unit.norm() - 1) < kUnitSlack) return unit;
  throw DataError(fmt::format("{}: {}: found a length of {}, expected 1", place, key, unit.norm()));
}

Json PatternJson(const MapPattern& pattern) {
  const auto unit = [](const Eigen::Vector3d& v) {
    return Json{Micrometres(v.x()), Micrometres(v.y()), Micrometres(v.z())};
  };
  return {{"id", pattern.id},
          {"segment", pattern.segment},
          {"origin", PointJson(pattern.origin_world)},
          {"direction", unit(pattern.direction_world)},
          {"across", unit(pattern.across_world)},
          {"spacing_m", Micrometres(pattern.spacing_m)},
          {"scatter_m", Micrometres(pattern.scatter_m)},
          {"along_m", IntervalJson(pattern.along_m)},
          {"across_m", IntervalJson(pattern.across_m)},
          {"lines", pattern.line_ids}};
}

MapPattern ParsePattern(const std::string& path, const Json& json, size_t index) {
  MapPattern pattern;
  pattern.id = static_cast<int64_t>(index);
  const std::string place = fmt::format("{}: pattern {}", path, index);
  BoundedAt(place, json, "id", pattern.id, pattern.id);
  pattern.segment = BoundedAt(place, json, "segment", 0, static_cast<int>(kMaxSegment));
  pattern.origin_world = ParsePoint<Eigen::Vector3d>(place, json.at("origin"), kMaxCoordinate_m);
  pattern.direction_world = ParseUnit(place, json, "direction");
  pattern.across_world = ParseUnit(place, json, "across");
  pattern.spacing_m = BoundedAt(place, json, "spacing_m", 1e-6, kMostDistance_m);
  pattern.scatter_m = BoundedAt(place, json, "scatter_m", 0.0, kMostDistance_m);
  pattern.along_m = ParseInterval(place, json, "along_m");
  pattern.across_m = ParseInterval(place, json, "across_m");
  pattern.line_ids = json.at("lines").get<std::vector<int64_t>>();
  return pattern;
}

}  // namespace

void WritePatterns(const std::string& path, const std::vector<MapPattern>& patterns) {
  Json json = Json::array();
  for (const MapPattern& pattern : patterns) json.push_back(PatternJson(pattern));
  WriteJsonFile(path, json);
}

std::vector<MapPattern> ReadPatterns(const std::string& path) {
  return ParseJsonFile(path, [&](const Json& json) {
    if (!json.is_array()) throw DataError(path + ": found no list, expected a list of patterns");
    std::vector<MapPattern> patterns;
    for (const Json& pattern : json) {
      patterns.push_back(ParsePattern(path, pattern, patterns.size()));
    }
    return patterns;
  });
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
  georeference.crs = found.at("crs").get<std::string>();
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
