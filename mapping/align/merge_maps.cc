#include "mapping/align/merge_maps.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "data/core/math.h"
#include "mapping/align/line_union.h"
#include "mapping/align/map_changes.h"
#include "mapping/align/surface_union.h"
#include "mapping/map/part_files.h"
#include "mapping/surfaces/bounded_plane.h"
#include "mapping/surfaces/junctions.h"
#include "mapping/views/view.h"

namespace slcmap::inline mapping {
namespace {

// What lines of maps that are aligned are off against each other here and there: trajectories err,
// and inexact buildings by more than covariances tell (FORMAT.md, "How well a line is known").
constexpr double kLinesOff_m = 0.009;
constexpr int64_t kHour_ns = 3600'000'000'000;

// By the verdict on its run: lines may all be of one of its segments.
bool WasLost(const MapResult& map) {
  return map.verdict && std::ranges::any_of(map.verdict->reasons, [](const VerdictReason& reason) {
           return reason.what == kLostReason;
         });
}

}  // namespace

void RequireMergeable(const MapResult& map) {
  if (map.dense.empty()) {
    throw DataError(
        fmt::format("map of run {}: found no dense points, as of a map that is empty or "
                    "was made with --sparse; expected some, by which maps are compared",
                    map.source.run_id));
  }
  std::optional<int> segment;
  bool is_one = !WasLost(map);
  for (const auto* lines : {&map.lines, &map.marks}) {
    for (const MapLine& line : *lines) {
      is_one = is_one && segment.value_or(line.segment) == line.segment;
      segment = line.segment;
      if (line.start_world != line.end_world) continue;
      throw DataError(
          fmt::format("map of run {}: found a line ({}) that ends where it starts, "
                      "expected a length",
                      map.source.run_id, line.id));
    }
  }
  if (is_one) return;
  throw DataError(
      fmt::format("map of run {}: found several segments, between which the estimator lost "
                  "itself; expected one, which is rigid",
                  map.source.run_id));
}

namespace {

// The time from the first pose to the last.
std::optional<StampSpan> FindSpan(const MapResult& map) {
  std::vector<int64_t> stamps_ns;
  for (const Trajectory* poses : {&map.trajectory, &map.keyframes}) {
    if (poses->empty()) continue;
    stamps_ns.push_back(poses->front().stamp_ns);
    stamps_ns.push_back(poses->back().stamp_ns);
  }
  if (stamps_ns.empty()) return std::nullopt;
  const auto [least, most] = std::minmax_element(stamps_ns.begin(), stamps_ns.end());
  return StampSpan{*least, *most};
}

}  // namespace

std::vector<MergedRun> SplitIntoParts(const MapResult& map) {
  if (!map.source.merged.empty()) return map.source.merged;
  MergedRun run;
  run.run_id = map.source.run_id;
  run.T_world_run = map.source.T_world_run;
  run.sequence = map.source.sequence;
  run.opened = map.source.opened;
  run.version = map.source.version;
  run.poses_ns = FindSpan(map);
  return {run};
}

namespace {

// By how much the second's stamps are moved: by nothing where its time is another, else by whole
// hours, so that no stamp is there twice.
int64_t StampShift(const MapResult& first, const MapResult& second) {
  const std::optional<StampSpan> a = FindSpan(first), b = FindSpan(second);
  if (!a || !b || b->from_ns > a->to_ns || b->to_ns < a->from_ns) return 0;
  return ((a->to_ns - b->from_ns) / kHour_ns + 1) * kHour_ns;
}

void MoveStamps(int64_t shift_ns, MapResult* map) {
  for (Trajectory* poses : {&map->trajectory, &map->keyframes}) {
    for (StampedPose& pose : *poses) pose.stamp_ns += shift_ns;
  }
  for (LineSupport& support : map->line_evidence.supports) support.stamp_ns += shift_ns;
  for (MapPointObservation& seen : map->point_observations) seen.stamp_ns += shift_ns;
}

void MoveLines(const RigidTransform& T, MapResult* map) {
  for (auto* lines : {&map->lines, &map->marks}) {
    for (MapLine& line : *lines) {
      line.start_world = T * line.start_world;
      line.end_world = T * line.end_world;
    }
  }
  const Eigen::Matrix3d R = T.rotation.toRotationMatrix();
  for (LineCovariance& covariance : map->line_evidence.covariances) {
    for (Eigen::Matrix3d* m :
         {&covariance.start_m2, &covariance.end_m2, &covariance.start_end_m2}) {
      *m = R * *m * R.transpose();
    }
  }
}

// All but occupancy and the building, which are made anew.
void MoveInto(const RigidTransform& T, MapResult* map) {
  for (Trajectory* poses : {&map->trajectory, &map->keyframes}) {
    for (StampedPose& pose : *poses) pose.T_world_imu = T * pose.T_world_imu;
  }
  for (MapPoint& point : map->points) point.p_world = T * point.p_world;
  for (DensePoint& point : map->dense) {
    point.p_world = T * point.p_world;
    point.normal_world = T.rotation * point.normal_world;
  }
  for (MapPipe& pipe : map->pipes) {
    pipe.start_world = T * pipe.start_world;
    pipe.end_world = T * pipe.end_world;
  }
  MoveLines(T, map);
}

// Images are those of rig.json: of other cameras none can be shown.
void MoveImages(const Rig& rig, MapResult* map) {
  if (IsSameRig(map->rectified_rig, rig)) {
    map->line_evidence.supports =
        SupportsInRig(map->line_evidence.supports, map->rectified_rig, rig);
    map->point_observations = ObservationsInRig(map->point_observations, map->rectified_rig, rig);
    return;
  }
  if (map->keyframes.empty()) return;
  map->warnings[kKeyframesOfOtherCameras] += static_cast<int64_t>(map->keyframes.size());
  map->keyframes.clear();
  map->line_evidence.supports.clear();
  map->point_observations.clear();
}

Trajectory UniteTrajectories(const Trajectory& first, const Trajectory& second) {
  Trajectory united;
  std::merge(first.begin(), first.end(), second.begin(), second.end(), std::back_inserter(united),
             [](const StampedPose& a, const StampedPose& b) { return a.stamp_ns < b.stamp_ns; });
  return united;
}

LinesOfMap TakeLines(MapResult* map) {
  LinesOfMap lines{std::move(map->lines), std::move(map->line_evidence)};
  lines.lines.insert(lines.lines.end(), map->marks.begin(), map->marks.end());
  map->lines.clear();
  map->marks.clear();
  return lines;
}

// The first map's place on Earth stays, and a second one that is elsewhere is told.
void UnitePlaces(const std::optional<Georeference>& second, MapResult* first) {
  constexpr double kSamePlace_m = 0.1, kTurnedApart_rad = 0.005;
  const std::optional<Georeference>& place = first->source.georeference;
  if (!place) {
    first->source.georeference = second;
    return;
  }
  if (!second) return;
  const double apart_m = (place->origin_m - second->origin_m).norm();
  const double turned_rad = std::abs(std::remainder(place->turn_rad - second->turn_rad, 2 * M_PI));
  const bool is_same = apart_m < kSamePlace_m && turned_rad < kTurnedApart_rad;
  if (place->crs == second->crs && is_same) return;
  const auto name = [](const std::string& crs) {
    return crs.empty() ? "a grid without name" : crs;
  };
  ++first->warnings["places_on_earth_differ"];
  spdlog::warn(
      "the maps were placed apart: found the second one in {}, its origin {:.2f} m from the first "
      "one's and turned by {:.2f} degrees against it, in {}, whose place is kept; expected the "
      "same control points",
      name(second->crs), apart_m, turned_rad / kDegree, name(place->crs));
}

void SetLines(LinesOfMap united, MapResult* map) {
  for (MapLine& line : united.lines) {
    (line.kind == LineKind::kMark ? map->marks : map->lines).push_back(line);
  }
  map->line_evidence = std::move(united.evidence);
}

UnitedPoints TakePoints(MapResult* map) {
  return {std::exchange(map->points, {}), std::exchange(map->point_observations, {})};
}

void SetPoints(UnitedPoints united, MapResult* map) {
  map->points = std::move(united.points);
  map->point_observations = std::move(united.observations);
}

std::optional<Verdict> UniteVerdicts(const MapResult& first, const MapResult& second) {
  if (!first.verdict || !second.verdict) return first.verdict ? first.verdict : second.verdict;
  Verdict united = *first.verdict;
  for (VerdictReason reason : second.verdict->reasons) {
    reason.found = fmt::format("run {}: {}", second.source.run_id, reason.found);
    united.Add(std::move(reason));
  }
  united.level = std::max(united.level, second.verdict->level);
  return united;
}

void UniteReports(const MapResult& second, MapResult* first) {
  first->verdict = UniteVerdicts(*first, second);
  for (const auto& [kind, count] : second.warnings) first->warnings[kind] += count;
  first->complete = first->complete && second.complete;
  first->interrupted = first->interrupted || second.interrupted;
  if (second.partial_reason.empty()) return;
  first->partial_reason += first->partial_reason.empty() ? "" : "; ";
  first->partial_reason += fmt::format("run {}: {}", second.source.run_id, second.partial_reason);
}

// Of maps that were not moved yet.
std::vector<MergedRun> UniteParts(const MapResult& first, const MapResult& second,
                                  const RigidTransform& T_first_second, int64_t shift_ns) {
  std::vector<MergedRun> parts = SplitIntoParts(first);
  for (MergedRun part : SplitIntoParts(second)) {
    part.stamps_moved_ns += shift_ns;
    part.T_world_run = T_first_second * part.T_world_run;
    if (part.poses_ns) part.poses_ns->from_ns += shift_ns;
    if (part.poses_ns) part.poses_ns->to_ns += shift_ns;
    parts.push_back(part);
  }
  return parts;
}

void UniteContents(const RigidTransform& T_first_second, const MergeOptions& options,
                   const Progress& progress, MapResult* first, MapResult* second) {
  first->dense = UniteSurfaces(first->dense, second->dense, options.dense_voxel_m);
  progress.ReportOrStop(0.3);
  SetPoints(UnitePoints(TakePoints(first), TakePoints(second), options.cloud_voxel_m), first);
  progress.ReportOrStop(0.4);
  SetLines(UniteLines(TakeLines(first), TakeLines(second), kLinesOff_m), first);
  first->pipes = UnitePipes(std::move(first->pipes), second->pipes, first->lines);
  progress.ReportOrStop(0.7);
  first->occupancy = UniteOccupancy(first->occupancy, second->occupancy, T_first_second,
                                    first->dense, options.dense_voxel_m);
}

// On the recording's clock.
std::optional<StampSpan> RecordedSpan(const MergedRun& part) {
  if (!part.poses_ns) return std::nullopt;
  return StampSpan{part.poses_ns->from_ns - part.stamps_moved_ns,
                   part.poses_ns->to_ns - part.stamps_moved_ns};
}

// Two runs of one recording see the same, with the same errors of its images. Parts of one may
// share some of it.
void WarnOfSameRecording(const std::vector<MergedRun>& second, MapResult* first) {
  for (const MergedRun& a : SplitIntoParts(*first)) {
    for (const MergedRun& b : second) {
      const std::optional<StampSpan> in_a = RecordedSpan(a), in_b = RecordedSpan(b);
      if (a.sequence.empty() || a.sequence != b.sequence || !in_a || !in_b) continue;
      const int64_t from_ns = std::max(in_a->from_ns, in_b->from_ns),
                    to_ns = std::min(in_a->to_ns, in_b->to_ns);
      const int64_t shorter_ns = std::min(in_a->to_ns - in_a->from_ns, in_b->to_ns - in_b->from_ns);
      if (to_ns - from_ns <= shorter_ns / 2) continue;
      ++first->warnings["recordings_merged_twice"];
      spdlog::warn("both maps have {:.1f} s of the recording {}: what is seen there counts twice",
                   ToSeconds(to_ns - from_ns), a.sequence);
    }
  }
}

}  // namespace

namespace {

// The days of a map's walks; none where one does not say it.
std::optional<std::pair<std::string, std::string>> FindDates(const MapResult& map) {
  std::vector<std::string> dates;
  for (const MergedRun& part : SplitIntoParts(map)) dates.push_back(part.date);
  const auto [least, most] = std::ranges::minmax(dates);
  if (least.empty()) return std::nullopt;
  return std::pair(least, most);
}

// Where all walks of one map are later than those of the other, what they saw to be gone is taken
// out of the other.
void UpdateEarlier(const RigidTransform& T_first_second, MapResult* first, MapResult* second) {
  const auto first_dates = FindDates(*first), second_dates = FindDates(*second);
  if (!first_dates || !second_dates) return;
  const bool is_second_later = first_dates->second < second_dates->first;
  if (!is_second_later && !(second_dates->second < first_dates->first)) return;
  MapResult *earlier = is_second_later ? first : second, *later = is_second_later ? second : first;
  const AlignmentFeatures before = FindFeatures(*earlier), after = FindFeatures(*later);
  const FeatureIndex before_index(before), after_index(after);
  const std::vector<MapChange> changes = FindChanges(
      {before, before_index, earlier->occupancy}, {after, after_index, later->occupancy},
      is_second_later ? T_first_second : T_first_second.Inverse());
  RemoveGone(changes, earlier);
}

}  // namespace

std::vector<std::string> CollectRuns(const MapResult& map) {
  std::vector<std::string> runs;
  for (const MergedRun& part : SplitIntoParts(map)) runs.push_back(part.run_id);
  return runs;
}

void RequireDifferentRuns(const MapResult& first, const MapResult& second) {
  const std::vector<std::string> runs = CollectRuns(first);
  for (const std::string& run : CollectRuns(second)) {
    if (run.empty() || std::find(runs.begin(), runs.end(), run) == runs.end()) continue;
    throw DataError(fmt::format("found run {} in both maps, expected maps of different runs", run));
  }
}

UnitedMaps PrepareToUnite(MapResult map) {
  map.filled.clear();  // the occupancy keeps what they said
  RemoveJunctions(&map);
  RequireMergeable(map);
  std::vector<RigPoses> watchers = {{map.keyframes, map.rectified_rig}};
  Names names = CollectNames(map.building);
  return {std::move(map), std::move(watchers), std::move(names)};
}

UnitedMaps UniteMaps(UnitedMaps united, UnitedMaps other, const RigidTransform& T_first_second,
                     const MergeOptions& options, const Progress& progress) {
  MapResult &first = united.map, &second = other.map;
  RequireDifferentRuns(first, second);
  WarnOfSameRecording(SplitIntoParts(second), &first);
  const int64_t shift_ns = StampShift(first, second);
  std::vector<MergedRun> parts = UniteParts(first, second, T_first_second, shift_ns);
  UpdateEarlier(T_first_second, &first, &second);
  MoveInto(T_first_second, &second);
  MoveStamps(shift_ns, &second);
  MoveImages(first.rectified_rig, &second);
  UniteContents(T_first_second, options, progress, &first, &second);
  for (RigPoses& watcher : other.watchers) {
    for (StampedPose& pose : watcher.poses) pose.T_world_imu = T_first_second * pose.T_world_imu;
    united.watchers.push_back(std::move(watcher));
  }
  AddNames(other.names, T_first_second, &united.names);
  first.trajectory = UniteTrajectories(first.trajectory, second.trajectory);
  first.keyframes = UniteTrajectories(first.keyframes, second.keyframes);
  first.source.merged = std::move(parts);
  UnitePlaces(MoveGeoreference(second.source.georeference, T_first_second), &first);
  UniteReports(second, &first);
  first.adjustment.reset();
  first.given_poses.reset();
  first.calibrated_rig.reset();
  first.id.clear();
  progress.ReportOrStop(1);
  return united;
}

std::vector<ViewRays> CollectViewRays(const UnitedMaps& united, double voxel_m,
                                      const Progress& progress) {
  std::vector<ViewRays> rays;
  for (const RigPoses& watcher : united.watchers) {
    std::vector<ViewRays> seen = CollectCloudRays(watcher.poses, watcher.rig, united.map.dense,
                                                  voxel_m, united.map.occupancy, progress);
    std::move(seen.begin(), seen.end(), std::back_inserter(rays));
  }
  return rays;
}

std::vector<ViewCameras> MakeViewCameras(const UnitedMaps& united) {
  std::vector<ViewCameras> cameras;
  for (const RigPoses& watcher : united.watchers) {
    Views views;
    for (const StampedPose& pose : watcher.poses) {
      views.push_back({pose.stamp_ns, 0, pose.T_world_imu});
    }
    cameras.emplace_back(views, watcher.rig);
  }
  return cameras;
}

}  // namespace slcmap::mapping
