#include "mapping/merged_runs.h"

#include <algorithm>

#include "data/polygon_json.h"
#include "data/sequence_options_json.h"
#include "odometry/run_rows.h"

namespace slcmap {
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

Json OffsetJson(const Eigen::Vector3d& world_offset_m) {
  return {world_offset_m.x(), world_offset_m.y(), world_offset_m.z()};
}

Eigen::Vector3d ParseOffset(const std::string& place, const Json& json) {
  constexpr double kMostOffset_m = 1e10;  // beyond the Earth
  if (!json.contains("world_offset_m")) return Eigen::Vector3d::Zero();
  return ParsePoint<Eigen::Vector3d>(place + ": world_offset_m", json.at("world_offset_m"),
                                     kMostOffset_m);
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

}  // namespace slcmap
