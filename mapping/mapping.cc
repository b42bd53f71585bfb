#include "mapping/mapping.h"

#include <spdlog/spdlog.h>

#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "data/core/error.h"
#include "data/core/progress.h"
#include "data/version.h"
#include "mapping/adjustment/adjustment.h"
#include "mapping/align/merge_maps.h"
#include "mapping/building/build_building.h"
#include "mapping/control/control.h"
#include "mapping/dense/dense_map.h"
#include "mapping/external_poses/pose_adjustment.h"
#include "mapping/external_poses/read_poses.h"
#include "mapping/lines/line_samples.h"
#include "mapping/lines/map_lines.h"
#include "mapping/lines/patterns.h"
#include "mapping/map/building.h"
#include "mapping/map/landmarks.h"
#include "mapping/map/map.h"
#include "mapping/map/rays.h"
#include "mapping/map/refinement.h"
#include "mapping/map/stage_store.h"
#include "mapping/options.h"
#include "mapping/pipes/pipes.h"
#include "mapping/surfaces/bounded_plane.h"
#include "mapping/surfaces/junctions.h"
#include "mapping/surfaces/plane_filling.h"
#include "mapping/surfaces/seen_share.h"
#include "mapping/views/recorded_views.h"
#include "mapping/views/view.h"
#include "mapping/views/view_matches.h"
#include "odometry/geometry/pinhole.h"
#include "odometry/run/run.h"
#include "odometry/run/run_queries.h"
#include "odometry/run/verdict.h"

namespace slcmap::inline mapping {

namespace {

constexpr double kAdjustedUntil = 0.1;  // share of the time, about
// Shares of the rest up to the end of a stage.
constexpr double kFusedUntil = 0.02, kFilteredUntil = 0.05, kDenseUntil = 0.45, kLinesUntil = 0.82,
                 kPipesUntil = 0.87, kBuiltUntil = 0.91;
constexpr double kAgreementUntil = 0.05, kVisibleUntil = 0.1, kAxes = 0.3;  // of the lines' part
constexpr char kDenseStage[] = "dense", kLineStage[] = "lines";             // as they are kept
constexpr char kImageUnreadable[] = "images_unreadable";

void MarkPartial(const std::string& reason, MapResult* map) {
  map->complete = false;
  map->partial_reason += (map->partial_reason.empty() ? "" : "; ") + reason;
}

// What was not complete yet when so much of the time had gone.
const char* MissingAt(double share, bool has_images) {
  if (share < kFilteredUntil) return "the cloud of points";
  if (!has_images) return "the occupancy";
  if (share < kDenseUntil) return "the dense cloud and the occupancy";
  if (share < kLinesUntil) return "the lines";
  if (share < kPipesUntil) return "the pipes";
  return share < kBuiltUntil ? "the building" : "filled planes and junctions";
}

// What lines may be off is as much as images and poses are.
MapLineOptions LineOptionsFor(const OdometryRun& run, const RecordedViews& recorded,
                              const MapLineOptions& options, const Progress& progress,
                              std::map<std::string, int64_t>* warnings) {
  const std::optional<double> across_px = JudgePoses(
      recorded.views, *recorded.images, run.method == kExternalPoses, progress, warnings);
  return across_px ? options.ForPoses(*across_px) : options;
}

// From the images in which lines were looked for to those that the map tells of.
void MoveSupports(const Rig& from, const Rig& to, std::vector<LineSupport>* supports) {
  for (LineSupport& support : *supports) {
    support.px = PixelFromPlane(to.cameras[support.camera],
                                PlaneFromPixel(from.cameras[support.camera], support.px));
  }
}

LinesOfMap CollectLines(const OdometryRun& run, const RecordedViews& recorded,
                        const std::vector<DensePoint>& dense, const MappingOptions& options,
                        const Progress& progress, std::map<std::string, int64_t>* warnings) {
  const MapLineOptions lines =
      LineOptionsFor(run, recorded, options.lines, progress.Part(0, kAgreementUntil), warnings);
  const RecordedViews chosen = ViewsForLines(recorded, options.lines.views);
  const VisibilityDepths depths(dense, options.dense.voxel_m,
                                ViewCameras(chosen.views, chosen.images->rig()),
                                progress.Part(kAgreementUntil, kVisibleUntil));
  const std::vector<BuildingAxis> axes = run.manhattan_worlds.empty()
                                             ? AxesOfViews(recorded.views, *recorded.images, lines,
                                                           progress.Part(kVisibleUntil, kAxes))
                                             : AxesOfRun(run, lines.min_axis_sigma_rad);
  LinesOfMap built = BuildLines(
      chosen.views, *chosen.images, axes,
      KnownLines(run, axes, options.run_lines.max_sigma_m, options.run_lines.min_observations),
      depths, LineSurfaces(dense), lines, progress.Part(kAxes, 1));
  MoveSupports(chosen.images->rig(), recorded.images->rig(), &built.evidence.supports);
  return built;
}

// A map of nothing is whole, but hardly what was wanted.
void ReportEmptyMap(MapResult* map) {
  if (CountDense(*map) == 0) ++map->warnings["no_dense_points"];
  if (map->lines.empty()) ++map->warnings["no_lines"];
}

// What a map lacks since the recording does not show it, or not to these poses.
void ReportMissing(const OdometryRun& run, const RecordedViews& recorded, MapResult* map) {
  if (const auto lost = recorded.lost ? recorded.lost->paths() : std::set<std::string>();
      !lost.empty()) {
    map->warnings[kImageUnreadable] += std::ssize(lost);
    const std::string found = fmt::format("{} images cannot be read", lost.size());
    spdlog::warn("{}, the first is {}", found, *lost.begin());
    MarkPartial(found, map);
  }
  const auto without_pose = run.warnings.find(kImageWithoutPose);
  if (without_pose != run.warnings.end()) {
    MarkPartial(fmt::format("{} images have no pose", without_pose->second), map);
  }
  if (map->warnings.contains(kPosesDisagree)) MarkPartial("poses and images do not agree", map);
}

// What is made without an image that will be there is not worth keeping.
bool IsWholeSoFar(const RecordedViews& recorded) {
  return !recorded.lost || recorded.lost->paths().empty();
}

void AddWarnings(const CountedWarnings& warnings, MapResult* map) {
  for (const auto& [kind, count] : warnings) map->warnings[kind] += count;
}

// A stage that was done before the map was stopped.
template <typename Stage>
std::optional<Stage> KeptStage(const StageStore& store, const char* name,
                               std::optional<Stage> (*unpack)(const std::string&)) {
  const auto bytes = store.Load(name);
  std::optional<Stage> stage = bytes ? unpack(*bytes) : std::nullopt;
  if (stage) {
    spdlog::info("goes on behind the stage {}, which was done before the map was stopped", name);
  }
  return stage;
}

std::vector<ViewRays> RunDenseStage(const RecordedViews& recorded, const MappingOptions& options,
                                    const StageStore& store, const Progress& progress,
                                    MapResult* map) {
  if (auto kept = KeptStage(store, kDenseStage, UnpackDense)) {
    map->dense = std::move(kept->dense);
    map->occupancy = std::move(kept->occupancy);
    AddWarnings(kept->warnings, map);
    return std::move(kept->rays);
  }
  CountedWarnings before = std::exchange(map->warnings, {});
  std::vector<ViewRays> rays =
      MapDensely(recorded.views, *recorded.images, options.dense, options.occupancy, progress, map);
  if (progress.Report(1) && IsWholeSoFar(recorded)) {
    store.Save(kDenseStage, [&] { return PackDense(*map, rays, map->warnings); });
  }
  AddWarnings(before, map);
  return rays;
}

// Marks are among the lines.
void RunLineStage(const OdometryRun& run, const RecordedViews& recorded,
                  const MappingOptions& options, const StageStore& store, const Progress& progress,
                  MapResult* map) {
  if (!options.stages.lines) {
    // Whether poses and images agree is told all the same.
    LineOptionsFor(run, recorded, options.lines, progress, &map->warnings);
    map->lines = SelectLines(run, options.run_lines);
    map->line_evidence = CollectEvidence(map->lines, run);
    return;
  }
  std::optional<LineStage> stage = KeptStage(store, kLineStage, UnpackLines);
  if (!stage) {
    stage.emplace();
    LinesOfMap built = CollectLines(run, recorded, map->dense, options, progress, &stage->warnings);
    stage->lines = std::move(built.lines);
    stage->evidence = std::move(built.evidence);
    if (progress.Report(1) && IsWholeSoFar(recorded)) {
      store.Save(kLineStage, [&] { return PackLines(*stage); });
    }
  }
  map->lines = std::move(stage->lines);
  map->line_evidence = std::move(stage->evidence);
  AddWarnings(stage->warnings, map);
}

// Planes and rooms, what is filled by them, junctions, and how much of what was seen the map holds:
// of what was measured, rays to it, and the cameras of the views that looked at it, by rig. Throws
// StoppedError once progress says so, and leaves what is done so far.
void RunBuildingStage(std::vector<ViewRays> rays, const std::vector<ViewCameras>& cameras,
                      const MappingOptions& options, const Progress& progress, MapResult* map) {
  constexpr double kBuilt = 0.33, kFilled = 0.85, kJoined = 0.95;  // shares of the time, about
  progress.ReportOrStop(0);
  const BuildingInput input = MakeBuildingInput(*map, std::move(rays));
  map->building = BuildBuilding(input, options.building, progress.Part(0, kBuilt));
  progress.ReportOrStop(kBuilt);
  SnapToPlanes(map->building, options.planes, &map->dense);
  if (options.planes.fill) {
    std::vector<DensePoint> filled = FillPlanes(
        {map->dense, map->lines, map->building, input.rays, cameras, options.dense.voxel_m},
        options.planes, progress.Part(kBuilt, kFilled));
    progress.ReportOrStop(kFilled);
    AddFilledPoints(std::move(filled), options.planes.cell_m, map);
  }
  AddJunctions(options.junctions, progress.Part(kFilled, kJoined), map);
  MeasureSeenShare({cameras, input.rays}, options.planes, progress.Part(kJoined, 1), map);
  JudgeSeenShare(map);
  spdlog::info("building: {} walls, {} planes, {} rooms; {} points in all with filled planes",
               map->building.walls.size(), map->building.planes.size(), map->building.rooms.size(),
               CountDense(*map));
}

// Planes, rooms and walls of a run without stereo images: from its lines and points, and the rays
// to them.
void BuildFromLines(const OdometryRun& run, const MappingOptions& options, const Progress& progress,
                    MapResult* map) {
  constexpr float kSigmaOfRays_m = 0.05F;
  std::vector<ViewRays> rays;
  for (const RayBundle& bundle : KeyframeRays(run, map->points)) {
    ViewRays& of_view = rays.emplace_back();
    of_view.p_world_camera = bundle.p_world_camera;
    for (const Eigen::Vector3d& p : bundle.p_world) of_view.p_world.push_back(p.cast<float>());
    of_view.sigma_m.assign(of_view.p_world.size(), kSigmaOfRays_m);
  }
  BuildingInput input = MakeBuildingInput(*map, std::move(rays));
  for (const MapPoint& point : map->points) {
    input.points.push_back({point.p_world, Eigen::Vector3d::Zero(), point.sigma_m});
  }
  try {
    map->building = BuildBuilding(input, options.building, progress.Part(0, 0.8));
    AddJunctions(options.junctions, progress.Part(0.8, 1), map);
  } catch (const StoppedError&) {
    spdlog::debug("the building was interrupted");
  }
  spdlog::info("building of lines and points: {} walls, {} planes, {} rooms",
               map->building.walls.size(), map->building.planes.size(), map->building.rooms.size());
}

// Poses, points and lines of a run are right for such images; their pixels are taken as if they
// were exposed at the stamp.
void WarnOfRows(const OdometryRun& run, MapResult* map) {
  if (!run.source || IsTakenAtOnce(run.source->raw_rig)) return;
  ++map->warnings["images_not_exposed_at_once"];
  spdlog::warn(
      "clouds and map lines take the images of each pair as exposed at its stamp: with a rolling "
      "shutter, or a right image taken later, they are off by what the rig moves meanwhile");
}

// Occupancy, the dense cloud, lines and the building, of the images of the keyframes.
void MapImages(const OdometryRun& run, const RecordedViews& recorded, const MappingOptions& options,
               const StageStore& store, const Progress& progress, MapResult* map) {
  map->rectified_rig = recorded.images->rig();  // with what was found of the cameras
  WarnOfRows(run, map);
  std::vector<ViewRays> rays =
      RunDenseStage(recorded, options, store, progress.Part(kFilteredUntil, kDenseUntil), map);
  RunLineStage(run, recorded, options, store, progress.Part(kDenseUntil, kLinesUntil), map);
  map->patterns = FindPatterns(&map->lines);
  map->marks = TakeMarks(&map->lines);
  spdlog::info("dense cloud: {} points; lines: {}, and {} marks, of which {} patterns are made",
               map->dense.size(), map->lines.size(), map->marks.size(), map->patterns.size());
  if (progress.Report(kLinesUntil)) {
    AddPipes(options.pipes, progress.Part(kLinesUntil, kPipesUntil), map);
  }
  if (!options.stages.building) return;
  ViewCameras cameras(recorded.views, map->rectified_rig);
  cameras.left_mask = recorded.images->mask(0);
  try {
    RunBuildingStage(std::move(rays), {cameras}, options, progress.Part(kPipesUntil, 1), map);
  } catch (const StoppedError&) {
    spdlog::debug("the building was interrupted");
  }
}

}  // namespace

MapResult MapRun(const OdometryRun& run, const RecordedViews* recorded,
                 const MappingOptions& options, const StageStore* store, const Progress& progress) {
  options.Check();
  MapResult map;
  map.source.run_id = run.id;
  map.source.options = options.ToYaml();
  if (run.source) {
    map.source.sequence = run.source->sequence;
    map.source.opened = run.source->opened;
    map.source.version = run.source->version;
    const Rig told = WithoutStamps(run.source->raw_rig, run.source->opened);
    if (!run.calibration.empty()) {
      map.calibrated_rig = CalibratedRig(told, run.rectified_rig, run.calibration.back());
    } else if (run.method == kExternalPoses) {
      map.calibrated_rig = told;
    }
  }
  map.method = run.method;
  map.complete = run.complete;
  map.partial_reason = run.partial_reason;
  map.warnings = run.warnings;
  map.verdict = run.verdict;
  map.rectified_rig = run.rectified_rig;

  std::optional<double> stopped_at;
  const Progress watched([&](double done) {
    if (!stopped_at && !progress.Report(done)) stopped_at = done;
    return !stopped_at;
  });
  map.trajectory = RefineTrajectory(run, &map.warnings);
  map.keyframes = KeyframeTrajectory(run.keyframes);
  map.points = FuseLandmarks(SelectLandmarks(run.landmarks, options.cloud), options.cloud,
                             watched.Part(0, kFusedUntil));
  map.points = RemoveOutliers(std::move(map.points), options.cloud,
                              watched.Part(kFusedUntil, kFilteredUntil));
  if (recorded) {
    MapImages(run, *recorded, options, store ? *store : StageStore(), watched, &map);
  } else {
    map.lines = SelectLines(run, options.run_lines);
    map.line_evidence = CollectEvidence(map.lines, run);
    const bool is_built = options.stages.building && !IsStereo(run.rectified_rig);
    map.occupancy = MapOccupancy(KeyframeRays(run, map.points), options.occupancy, &map.warnings,
                                 watched.Part(kFilteredUntil, is_built ? kPipesUntil : 1));
    if (is_built) BuildFromLines(run, options, watched.Part(kPipesUntil, 1), &map);
  }
  FindLinesOfPoints(map.lines, &map.points);
  map.point_observations = CollectObservations(map.points, run, map.rectified_rig);
  if (recorded) ReportMissing(run, *recorded, &map);
  if (recorded && !stopped_at) ReportEmptyMap(&map);
  map.interrupted = stopped_at.has_value();
  if (stopped_at) {
    MarkPartial(fmt::format("mapping was interrupted before {}",
                            MissingAt(*stopped_at, recorded != nullptr)),
                &map);
  }
  if (map.trajectory.empty()) MarkPartial("the run has no pose", &map);
  return map;
}

namespace {

// The recording, with its IMU where that can be read.
Sequence OpenWithImu(const std::string& sequence, SequenceOptions options) {
  try {
    options.needs_imu = true;
    return OpenSequence(sequence, options);
  } catch (const DataError&) {
    options.needs_imu = false;
    return OpenSequence(sequence, options);
  }
}

// Whether the images of the keyframes are to be looked at, and are there for both cameras.
bool HasImages(const MapInput& input, const OdometryRun& run) {
  return !input.sparse && !run.keyframes.empty() && run.source && IsStereo(run.source->raw_rig);
}

// Of a run whose poses were given.
std::optional<ExternalPoseFigures> AdjustGiven(const ExternalPoseOptions& options,
                                               const SharedImageCache& cache,
                                               const Progress& progress, MapInput* input) {
  OdometryRun& run = input->run;
  if (!options.adjust || run.method != kExternalPoses || !HasImages(*input, run)) {
    return std::nullopt;
  }
  const auto images = KeyframeImages(run, input->recording, cache);
  const auto figures = AdjustExternalPoses(*images, options, &run, progress);
  const std::string fault =
      figures ? TooFarMoved(*figures, input->off_by_pairs_rad, input->off_by_pairs_m) : "";
  if (!fault.empty()) {
    ++run.warnings[kPosesDisagree];
    spdlog::warn("{}: {}; expected the poses of this recording", input->name, fault);
  }
  return figures;
}

// Where revisits are looked for in them: the images of the keyframes with the calibration that
// odometry found, which is good enough to recognise a place; else none.
std::unique_ptr<ViewImages> ImagesOfRevisits(const MapInput& input,
                                             const AdjustmentOptions& options,
                                             const SharedImageCache& cache) {
  const bool are_wanted = options.enabled && options.closures.enabled && options.closures.points;
  if (!are_wanted || input.run.method == kExternalPoses || !HasImages(input, input.run)) {
    return nullptr;
  }
  return KeyframeImages(input.run, input.recording, cache);
}

// The images of the run's keyframes; nothing where the map is made without them.
std::optional<RecordedViews> OpenViews(const MapInput& input, const OdometryRun& run,
                                       const SharedImageCache& cache) {
  if (HasImages(input, run)) return ViewsOfRun(run, input.recording, cache);
  if (!input.sparse && !run.keyframes.empty()) {
    spdlog::warn("{}: a run {} is mapped from its landmarks alone", input.name,
                 !run.source                          ? "that does not say where its images are"
                 : HasTwoCameras(run.source->raw_rig) ? "of cameras that look apart"
                                                      : "of one camera");
  }
  return std::nullopt;
}

// Kept of runs that say what they are: one that was killed may be another one the next time.
StageStore OpenStore(const MapInput& input, const OdometryRun& run, const MappingOptions& options) {
  if (input.stages.empty() || run.id.empty()) return {};
  try {
    const std::string images = StatesOfImages(run, input.recording);
    return {input.stages, StageKey(run, images, options.ToYaml(), ProgramId())};
  } catch (const DataError& error) {
    spdlog::debug("stages are not kept: {}", error.what());
    return {};
  }
}

}  // namespace

MapInput ReadInputAtPoses(const std::string& sequence, const SequenceOptions& opened,
                          const std::string& poses, const PoseForm& form) {
  ExternalPoses given = ReadExternalPoses(poses, form, OpenWithImu(sequence, opened), true);
  MapInput input{.run = RunAtPoses(sequence, opened, given.trajectory), .name = poses};
  input.run.source->version = kVersion;
  if (!given.reading.change.empty()) ++input.run.warnings[kPosesDisagree];
  if (given.reading.is_judged) {
    input.off_by_pairs_rad = given.reading.best.turn_rad;
    input.off_by_pairs_m = given.reading.best.way_m;
  }
  input.world_offset_m = given.world_offset_m;
  return input;
}

MapResult BuildMap(MapInput input, const MappingOptions& options, const Progress& progress) {
  options.Check();
  OdometryRun& run = input.run;
  // Of one that was cut off, or of an earlier version.
  if (!run.verdict && run.method != kExternalPoses) run.verdict = JudgeRun(run, VerdictOptions());
  const auto cache = std::make_shared<ImageCache>();
  const auto given =
      AdjustGiven(options.given_poses, cache, progress.Part(0, kAdjustedUntil), &input);
  const auto images = ImagesOfRevisits(input, options.adjustment, cache);
  const auto ties = input.control ? TieToControl(*input.control, &run) : ControlTies();
  if (run.verdict && run.warnings.contains(kScaledToControl)) run.verdict->Withdraw(kScaleReason);
  AdjustedRun adjusted = AdjustRun(std::move(run), options.adjustment, images.get(),
                                   progress.Part(0, kAdjustedUntil), ties);
  const RigidTransform T_world_run = TurnAlongBuilding(&adjusted.run);
  // Images are rectified with the calibration that the adjustment found.
  const std::optional<RecordedViews> recorded = OpenViews(input, adjusted.run, cache);
  const StageStore store = recorded ? OpenStore(input, adjusted.run, options) : StageStore();
  MapResult map = MapRun(adjusted.run, recorded ? &*recorded : nullptr, options, &store,
                         progress.Part(kAdjustedUntil, 1));
  map.source.T_world_run = T_world_run;
  if (!input.world_offset_m.isZero()) {
    map.source.georeference = Georeference{.crs = "", .origin_m = input.world_offset_m};
  }
  map.adjustment = adjusted.figures;
  map.given_poses = given;
  return map;
}

namespace {

constexpr double kUnited = 0.8, kRaysCollected = 0.85;  // shares of the time, about

MergeOptions OptionsOfUnion(const MappingOptions& options) {
  return {options.cloud.voxel_m, options.dense.voxel_m};
}

// The building of maps that were united, with what hangs on it.
MapResult FinishUnion(UnitedMaps united, const MappingOptions& options, const Progress& progress) {
  std::vector<ViewRays> rays =
      CollectViewRays(united, options.dense.voxel_m, progress.Part(kUnited, kRaysCollected));
  MappingOptions of_building = options;
  of_building.planes.draw_sigmas = 0;  // points lie where their own map's planes drew them
  RunBuildingStage(std::move(rays), MakeViewCameras(united), of_building,
                   progress.Part(kRaysCollected, 1), &united.map);
  ApplyNames(united.names, &united.map);
  FindLinesOfPoints(united.map.lines, &united.map.points);
  std::vector<MapLine> marks = united.map.marks;  // each map has weighed its own by patterns
  united.map.patterns = FindPatterns(&marks);
  progress.ReportOrStop(1);
  united.map.plan.reset();  // of the first map's walls alone
  united.map.control.reset();
  united.map.source.options = options.ToYaml();
  return std::move(united.map);
}

UnitedMaps ReadToUnite(const MapToMerge& map) {
  MapResult read = map.read();
  if (read.source.merged.empty()) {
    read.source.merged = SplitIntoParts(read);
    read.source.merged.front().date = map.date;
  }
  return PrepareToUnite(std::move(read));
}

// Of some neighbours, in the world of the first of them. Halves, so that each is read and united as
// late as can be.
UnitedMaps UniteNeighbours(std::span<const MapToMerge> maps, const MergeOptions& options,
                           const Progress& progress) {
  if (maps.size() == 1) return ReadToUnite(maps.front());
  const std::size_t half = (maps.size() + 1) / 2;
  const double part = static_cast<double>(half) / static_cast<double>(maps.size() + 1);
  UnitedMaps first = UniteNeighbours(maps.first(half), options, progress.Part(0, part));
  UnitedMaps second = UniteNeighbours(maps.subspan(half), options, progress.Part(part, 2 * part));
  const RigidTransform T_first_second = maps.front().T_world_map.Inverse() * maps[half].T_world_map;
  return UniteMaps(std::move(first), std::move(second), T_first_second, options,
                   progress.Part(2 * part, 1));
}

}  // namespace

MapResult MergeMaps(const std::vector<MapToMerge>& maps, const MappingOptions& options,
                    const Progress& progress) {
  options.Check();
  return FinishUnion(UniteNeighbours(maps, OptionsOfUnion(options), progress.Part(0, kUnited)),
                     options, progress);
}

}  // namespace slcmap::mapping
