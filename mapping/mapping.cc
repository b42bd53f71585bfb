#include "mapping/mapping.h"

#include <spdlog/spdlog.h>

#include <set>
#include <string>
#include <vector>

#include "data/core/progress.h"
#include "mapping/building/build_building.h"
#include "mapping/dense/dense_map.h"
#include "mapping/lines/line_samples.h"
#include "mapping/lines/map_lines.h"
#include "mapping/map/building.h"
#include "mapping/map/landmarks.h"
#include "mapping/map/map.h"
#include "mapping/map/rays.h"
#include "mapping/map/refinement.h"
#include "mapping/options.h"
#include "mapping/pipes/pipes.h"
#include "mapping/surfaces/bounded_plane.h"
#include "mapping/surfaces/junctions.h"
#include "mapping/surfaces/plane_filling.h"
#include "mapping/views/view.h"
#include "mapping/views/view_matches.h"
#include "odometry/geometry/pinhole.h"
#include "odometry/run/run.h"
#include "odometry/run/run_queries.h"

namespace slcmap::inline mapping {

inline constexpr const char* kDenseViewWithoutImages = "dense_views_without_images";

// Sets the map's dense points, and its occupancy to what confirmed depth shows, and returns what
// each view saw; warnings count views that could not be used. Once progress says so, they are those
// of the views so far. Throws ConfigError when an option is not plausible, or would take too much
// memory.
std::vector<ViewRays> MapDensely(const Views& views, const ViewImages& images,
                                 const MappingOptions& options, const Progress& progress,
                                 MapResult* map);

namespace {

// Every other node is enough for openings, which are some 40 cm wide.
ViewRays CollectViewRays(const RigidTransform& T_world_camera, const Camera& camera,
                         const DepthGrid& depth) {
  constexpr int kStep = 2;
  ViewRays sights;
  sights.p_world_camera = T_world_camera.translation;
  for (int row = 0; row < depth.rows; row += kStep) {
    for (int column = 0; column < depth.columns; column += kStep) {
      const DepthNode& node = depth.At(column, row);
      if (!node.is_known()) continue;
      const Eigen::Vector3d ray =
          PinholeRay(camera, depth.ColumnPixel(column), depth.RowPixel(row));
      sights.p_world.push_back((T_world_camera * (node.depth_m() * ray)).cast<float>());
      sights.sigma_m.push_back(static_cast<float>(node.depth_sigma_m() * ray.norm()));
    }
  }
  return sights;
}

}  // namespace

std::vector<ViewRays> MapDensely(const Views& views, const ViewImages& images,
                                 const MappingOptions& options, const Progress& progress,
                                 MapResult* map) {
  DepthOccupancy occupancy(options.occupancy);
  const Rig& rig = images.rig();
  std::vector<ViewRays> sights;
  DenseMap dense = BuildDense(
      views, images, options.dense, progress, [&](std::size_t view, const DepthGrid& depth) {
        const RigidTransform T_world_camera = WorldFromCamera(views[view], rig);
        occupancy.Add(T_world_camera, rig.cameras[0], depth);
        sights.push_back(CollectViewRays(T_world_camera, rig.cameras[0], depth));
      });
  map->dense = std::move(dense.points);
  map->occupancy = occupancy.Finish(map->dense, options.dense.voxel_m);
  if (dense.views_without_images > 0) {
    map->warnings[kDenseViewWithoutImages] += dense.views_without_images;
  }
  if (occupancy.out_of_octree() > 0) map->warnings[kRayOutOfOctree] += occupancy.out_of_octree();
  return sights;
}

namespace {

// Shares of the time, about, up to the end of a stage.
constexpr double kFusedUntil = 0.02, kFilteredUntil = 0.05, kDenseUntil = 0.45, kLinesUntil = 0.82,
                 kPipesUntil = 0.87, kBuiltUntil = 0.91;
constexpr double kAgreementUntil = 0.05, kSightsUntil = 0.1, kAxes = 0.3;  // of the lines' part
constexpr char kDenseStage[] = "dense", kLineStage[] = "lines";            // as they are kept
constexpr char kImageUnreadable[] = "images_unreadable";
constexpr double kMaxPoseError_px = 3, kMinPointsFound = 0.2;
constexpr size_t kLeastViewsOfRun = 10;

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

// Poses by anyone may be of another recording, frame or unit, and a run's images may have changed
// since.
void WarnOfPoses(const std::string& found, bool are_given,
                 std::map<std::string, int64_t>* warnings) {
  ++(*warnings)[kPosesDisagree];
  spdlog::warn("{}; expected agreement to {} px, and at least {:.0f} % of points: are {}?", found,
               kMaxPoseError_px, 100 * kMinPointsFound,
               are_given ? "the poses those of the IMU, in metres, with the images' stamps"
                         : "the images those that the run was made of");
}

// What lines may be off is as much as images and poses are.
MapLineOptions LineOptionsFor(const OdometryRun& run, const RecordedViews& recorded,
                              const MapLineOptions& options, const Progress& progress,
                              std::map<std::string, int64_t>* warnings) {
  const bool are_given = run.method == kExternalPoses;
  const auto agreement = MeasurePoseAgreement(recorded.views, *recorded.images, progress);
  if (!agreement) {
    // A run that hardly moved has few views, none of which tells of another.
    const size_t least = are_given ? 2 : kLeastViewsOfRun;
    if (recorded.views.size() >= least && progress.Report(1)) {
      WarnOfPoses("no two views see points in common by their poses", are_given, warnings);
    }
    return options;
  }
  const std::string found =
      agreement->across_px
          ? fmt::format(
                "poses and images agree to {:.2f} px in {} pairs of views, and {:.0f} % of "
                "points are where they are expected",
                *agreement->across_px, agreement->pairs, 100 * agreement->found)
          : fmt::format(
                "no two views show enough points to say how well poses and images agree: {:.0f} % "
                "are where they are expected",
                100 * agreement->found);
  spdlog::debug("{}", found);
  const bool are_doubtful =
      agreement->across_px.value_or(0) > kMaxPoseError_px || agreement->found < kMinPointsFound;
  if (are_doubtful) WarnOfPoses(found, are_given, warnings);
  return agreement->across_px ? options.ForPoses(*agreement->across_px) : options;
}

VisibilityDepths MakeDepthMaps(const std::vector<DensePoint>& dense, const RecordedViews& recorded,
                               const MappingOptions& options, const Progress& progress) {
  return {dense, options.dense.voxel_m, ViewCameras(recorded.views, recorded.images->rig()),
          progress};
}

// From the images in which lines were looked for to those that the map tells of.
void MoveSupports(const Rig& from, const Rig& to, std::vector<LineSupport>* supports) {
  for (LineSupport& support : *supports) {
    support.px = PixelFromPlane(to.cameras[support.camera],
                                PlaneFromPixel(from.cameras[support.camera], support.px));
  }
}

BuiltLines CollectLines(const OdometryRun& run, const RecordedViews& recorded,
                        const std::vector<DensePoint>& dense, const MappingOptions& options,
                        const Progress& progress, std::map<std::string, int64_t>* warnings) {
  const MapLineOptions lines =
      LineOptionsFor(run, recorded, options.lines, progress.Part(0, kAgreementUntil), warnings);
  const RecordedViews chosen = ViewsForLines(recorded, options.lines.views);
  const VisibilityDepths depths =
      MakeDepthMaps(dense, chosen, options, progress.Part(kAgreementUntil, kSightsUntil));
  const std::vector<BuildingAxis> axes =
      run.manhattan_worlds.empty()
          ? AxesOfViews(recorded.views, *recorded.images, lines, progress.Part(kSightsUntil, kAxes))
          : AxesOfRun(run, lines.min_axis_sigma_rad);
  BuiltLines built = BuildLines(
      chosen.views, *chosen.images, axes,
      KnownLines(run, axes, options.run_lines.max_sigma_m, options.run_lines.min_observations),
      depths, LineSurfaces(dense), lines, progress.Part(kAxes, 1));
  MoveSupports(chosen.images->rig(), recorded.images->rig(), &built.evidence.supports);
  return built;
}

void AddFilledPlanes(const RecordedViews& recorded, const std::vector<ViewRays>& sights,
                     const MappingOptions& options, const Progress& progress, MapResult* map) {
  if (!options.planes.fill) return;
  const ViewCameras cameras(recorded.views, recorded.images->rig());
  const std::vector<DensePoint> filled =
      FillPlanes({map->dense, map->lines, map->building, sights, {cameras}, options.dense.voxel_m},
                 options.planes, options.dense.threads, progress);
  AddFilledPoints(filled, options.planes.cell_m, map);
}

// A map of nothing is whole, but hardly what was wanted.
void ReportEmptyMap(MapResult* map) {
  if (map->dense.empty()) ++map->warnings["no_dense_points"];
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
    return std::move(kept->sights);
  }
  CountedWarnings before = std::exchange(map->warnings, {});
  std::vector<ViewRays> sights =
      MapDensely(recorded.views, *recorded.images, options, progress, map);
  if (progress.Report(1) && IsWholeSoFar(recorded)) {
    store.Save(kDenseStage, [&] { return PackDense(*map, sights, map->warnings); });
  }
  AddWarnings(before, map);
  return sights;
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
    BuiltLines built = CollectLines(run, recorded, map->dense, options, progress, &stage->warnings);
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

void RunPipeStage(const RecordedViews& recorded, const MappingOptions& options,
                  const Progress& progress, MapResult* map) {
  const RecordedViews chosen = ViewsForLines(recorded, options.lines.views);
  const PipeImages images{chosen.views, *chosen.images};
  AddPipes(options.pipes, &images, progress, map);
}

void RunBuildingStage(const RecordedViews& recorded, std::vector<ViewRays> sights,
                      const MappingOptions& options, const Progress& progress, MapResult* map) {
  constexpr double kBuilt = 0.33, kFilled = 0.87;  // shares of the time
  const BuildingInput input = MakeBuildingInput(*map, std::move(sights));
  if (progress.Report(0)) map->building = BuildBuilding(input, options.building);
  if (progress.Report(kBuilt)) SnapToPlanes(map->building, options.planes, &map->dense);
  AddFilledPlanes(recorded, input.sights, options, progress.Part(kBuilt, kFilled), map);
  AddJunctions(options.junctions, progress.Part(kFilled, 1), map);
  spdlog::info("building: {} walls, {} planes, {} rooms; {} points in all with filled planes",
               map->building.walls.size(), map->building.planes.size(), map->building.rooms.size(),
               map->dense.size());
}

// Occupancy, the dense cloud, lines and the building, of the images of the keyframes.
void MapImages(const OdometryRun& run, const RecordedViews& recorded, const MappingOptions& options,
               const StageStore& store, const Progress& progress, MapResult* map) {
  map->rectified_rig = recorded.images->rig();  // with what was found of the cameras
  std::vector<ViewRays> sights =
      RunDenseStage(recorded, options, store, progress.Part(kFilteredUntil, kDenseUntil), map);
  RunLineStage(run, recorded, options, store, progress.Part(kDenseUntil, kLinesUntil), map);
  map->marks = TakeMarks(&map->lines);
  spdlog::info("dense cloud: {} points; lines: {}, and {} marks", map->dense.size(),
               map->lines.size(), map->marks.size());
  if (progress.Report(kLinesUntil)) {
    RunPipeStage(recorded, options, progress.Part(kLinesUntil, kPipesUntil), map);
  }
  if (!options.stages.building) return;
  RunBuildingStage(recorded, std::move(sights), options, progress.Part(kPipesUntil, 1), map);
}

}  // namespace

MapResult BuildMap(const OdometryRun& run, const RecordedViews* recorded,
                   const MappingOptions& options, const StageStore& store,
                   const Progress& progress) {
  options.Check();
  MapResult map;
  map.source.run_id = run.id;
  map.source.options = options.ToYaml();
  if (run.source) {
    map.source.sequence = run.source->sequence;
    map.source.opened = run.source->opened;
    map.source.version = run.source->version;
    if (!run.calibration.empty()) {
      map.calibrated_rig =
          CalibratedRig(run.source->raw_rig, run.rectified_rig, run.calibration.back());
    } else if (run.method == kExternalPoses) {
      map.calibrated_rig = run.source->raw_rig;
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
    MapImages(run, *recorded, options, store, watched, &map);
  } else {
    map.lines = SelectLines(run, options.run_lines);
    map.line_evidence = CollectEvidence(map.lines, run);
    map.occupancy = MapOccupancy(KeyframeRays(run, map.points), options.occupancy, &map.warnings,
                                 watched.Part(kFilteredUntil, 1));
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

}  // namespace slcmap::mapping
