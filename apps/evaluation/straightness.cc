#include "apps/evaluation/straightness.h"

#include <cmath>

namespace slcmap {
namespace {

using Eigen::Vector3d;

std::vector<WeightedDirection> CollectDirections(const EdgeStraightness& edges,
                                            const StraightnessOptions& options) {
  std::vector<WeightedDirection> directions;
  for (const FittedEdge& line : edges.lines) {
    if (line.length_m < options.min_line_m) continue;
    if (line.direction_sigma_rad > options.max_direction_sigma_rad) continue;
    directions.push_back({line.direction_world, line.length_m});
  }
  return directions;
}

std::vector<Vector3d> FlatPoints(const std::vector<PointOfPair>& points,
                                 const Trajectory& trajectory, double max_sigma_m) {
  std::vector<Vector3d> placed;
  for (const PointOfPair& point : points) {
    if (point.place.covariance_m2.trace() > max_sigma_m * max_sigma_m) continue;
    const auto pose = PoseAt(trajectory, point.stamp_ns);
    if (pose) placed.push_back(*pose * point.place.p_imu);
  }
  return placed;
}

}  // namespace

StraightnessReference MakeReference(const OdometryRun& run, const Trajectory& final_poses,
                                    const std::vector<const Trajectory*>& trajectories,
                                    const KnownTruth& truth, const StraightnessOptions& options,
                                    const Progress& progress) {
  StraightnessReference reference;
  reference.true_poses = !truth.trajectory.empty();
  reference.true_edges = reference.true_poses && !truth.edges.whole.empty();
  const Trajectory& poses = reference.true_poses ? truth.trajectory : final_poses;
  std::vector<const Trajectory*> all = trajectories;
  all.push_back(&poses);
  reference.observations =
      SeenByAll(ObservationsOfRun(run, options.placement, progress.Part(0, 0.2)), all);
  progress.ReportOrStop(0.3);
  std::vector<EdgeObservation>& edges = reference.observations.edges;
  edges = reference.true_edges ? OnTrueEdges(edges, poses, truth.edges, options.placement)
                               : OfOneEdge(edges, poses, options.edges);
  progress.ReportOrStop(0.6);
  const auto directions = MeasureDirections(
      CollectDirections(RetriangulateEdges(edges, poses, options.edges, progress.Part(0.6, 0.9)),
                   options),
      options.directions);
  progress.ReportOrStop(0.9);
  if (directions) {
    reference.walls =
        FindWalls(reference.observations.points, poses, directions->axes, options.walls);
  }
  return reference;
}

Straightness MeasureStraightness(const StraightnessReference& reference,
                                 const Trajectory& trajectory, const Trajectory& truth,
                                 const StraightnessOptions& options, const Progress& progress) {
  const ReferenceObservations& observations = reference.observations;
  Straightness result;
  result.edges =
      RetriangulateEdges(observations.edges, trajectory, options.edges, progress.Part(0, 0.4));
  result.directions = MeasureDirections(CollectDirections(result.edges, options), options.directions);
  result.flatness =
      MeasureFlatness(FlatPoints(observations.points, trajectory, options.max_flat_sigma_m),
                      options.flatness, progress.Part(0.4, 0.8));
  progress.ReportOrStop(0.8);
  const std::vector<SurveyedPoints> walls =
      PlaceWalls(reference.walls, observations.points, trajectory);
  result.survey = SurveyWalls(walls, Vector3d::UnitZ(), options.survey);
  progress.ReportOrStop(0.9);
  if (!truth.empty()) {
    const std::vector<SurveyedPoints> true_walls =
        PlaceWalls(reference.walls, observations.points, truth);
    result.added = SurveyWalls(BendsAdded(walls, true_walls, Vector3d::UnitZ(), options.survey),
                               Vector3d::UnitZ(), options.survey);
  }
  return result;
}

MapStraightness MeasureMapStraightness(const Building& building,
                                       const std::vector<DensePoint>& cloud,
                                       const StraightnessOptions& options,
                                       const Progress& progress) {
  std::vector<Vector3d> points;
  for (const DensePoint& point : cloud) {
    if (point.source == DenseSource::kStereo) points.push_back(point.p_world);
  }
  FlatnessOptions flatness = options.flatness;
  flatness.radius_m = options.dense_radius_m;
  return {MeasureFlatness(points, flatness, progress),
          SurveyWalls(WallsOfMap(building, cloud, options.map_walls), Vector3d::UnitZ(),
                      options.survey)};
}

}  // namespace slcmap
