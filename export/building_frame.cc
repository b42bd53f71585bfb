#include "export/building_frame.h"

#include <cmath>

#include "export/world_offset.h"
#include "mapping/merged_runs.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

void TurnPoint(const RigidTransform& T, Vector3d* p) { *p = T * *p; }

void TurnPoints(const RigidTransform& T, std::vector<Vector3d>* points) {
  for (Vector3d& p : *points) p = T * p;
}

void TurnPlanPoints(const RigidTransform& T, PlanPoints* points) {
  for (Eigen::Vector2d& p : *points) p = (T * Vector3d(p.x(), p.y(), 0)).head<2>();
}

void TurnBuilding(const RigidTransform& T, Building* building) {
  for (BuildingPlane& plane : building->planes) {
    plane.normal = T.rotation * plane.normal;
    TurnPoints(T, &plane.outline_world);
    for (PlaneOpening& opening : plane.openings) TurnPoints(T, &opening.outline_world);
  }
  for (Room& room : building->rooms) {
    TurnPlanPoints(T, &room.polygon.outline);
    for (PlanPoints& hole : room.polygon.holes) TurnPlanPoints(T, &hole);
  }
  for (PlanWall& wall : building->walls) {
    PlanPoints ends = {wall.start, wall.end};
    TurnPlanPoints(T, &ends);
    wall.start = ends[0];
    wall.end = ends[1];
  }
  building->T_map_world = {};
}

void TurnLines(const RigidTransform& T, MapResult* map) {
  for (auto* lines : {&map->lines, &map->marks}) {
    for (MapLine& line : *lines) {
      TurnPoint(T, &line.start_world);
      TurnPoint(T, &line.end_world);
    }
  }
  for (MapPipe& pipe : map->pipes) {
    TurnPoint(T, &pipe.start_world);
    TurnPoint(T, &pipe.end_world);
  }
  const Eigen::Matrix3d R = T.rotation.toRotationMatrix();
  for (LineCovariance& covariance : map->line_evidence.covariances) {
    for (auto* m : {&covariance.start_m2, &covariance.end_m2, &covariance.start_end_m2}) {
      *m = R * *m * R.transpose();
    }
  }
}

void TurnContent(const RigidTransform& T, MapResult* map) {
  map->source.T_world_run = T * map->source.T_world_run;
  for (MergedRun& run : map->source.merged) run.T_world_run = T * run.T_world_run;
  for (Trajectory* poses : {&map->trajectory, &map->keyframes}) {
    for (StampedPose& pose : *poses) pose.T_world_imu = T * pose.T_world_imu;
  }
  for (MapPoint& point : map->points) TurnPoint(T, &point.p_world);
  for (DensePoint& point : map->dense) {
    TurnPoint(T, &point.p_world);
    point.normal_world = T.rotation * point.normal_world;
  }
  TurnLines(T, map);
  TurnBuilding(T, &map->building);
}

// The cells whose centres are in a voxel that was turned.
void AddCells(const Voxel& voxel, const RigidTransform& T, double resolution_m,
              std::vector<OctreeCell>* cells) {
  const RigidTransform T_back = T.Inverse();
  const double half_m = 0.5 * voxel.size_m;
  const double turn_rad = 2 * std::atan2(T.rotation.z(), T.rotation.w());
  const double reach_m = half_m * (std::abs(std::cos(turn_rad)) + std::abs(std::sin(turn_rad)));
  const Vector3d centre = T * voxel.centre_world;
  const Vector3d reach(reach_m, reach_m, half_m);
  const Vector3d low = (centre - reach) / resolution_m, high = (centre + reach) / resolution_m;
  for (int x = static_cast<int>(std::floor(low.x())); x <= high.x(); ++x) {
    for (int y = static_cast<int>(std::floor(low.y())); y <= high.y(); ++y) {
      const Vector3d p = T_back * Vector3d(resolution_m * (x + 0.5), resolution_m * (y + 0.5), 0);
      const Eigen::Array2d off = (p - voxel.centre_world).head<2>().array();
      if (!((off >= -half_m) && (off < half_m)).all()) continue;
      const int from = static_cast<int>(std::lround(low.z()));
      const int to = static_cast<int>(std::lround(high.z()));
      for (int z = from; z < to; ++z) cells->emplace_back(x, y, z);
    }
  }
}

OccupancyMap TurnedOccupancy(const OccupancyMap& occupancy, const RigidTransform& T,
                             const Progress& progress) {
  OccupancyMap turned(occupancy.resolution_m());
  for (const bool occupied : {false, true}) {
    const std::vector<Voxel> voxels =
        occupied ? occupancy.OccupiedVoxels() : occupancy.FreeVoxels();
    CellObservation cells;
    for (std::size_t i = 0; i < voxels.size(); ++i) {
      std::vector<OctreeCell>& kind = occupied ? cells.occupied : cells.free;
      AddCells(voxels[i], T, turned.resolution_m(), &kind);
      if (kind.size() < 100000 && i + 1 < voxels.size()) continue;
      progress.ReportOrStop(0);
      turned.Mark(cells);
      kind.clear();
    }
  }
  turned.Finish();
  return turned;
}

// All but the occupancy, which is not copied. The names of all members stand here, so that the
// compiler says where one is missing.
MapResult CopyOf(const MapResult& map) {
  const auto& [id, source, method, complete, partial_reason, interrupted, warnings, verdict,
               rectified_rig, adjustment, given_poses, calibrated_rig, trajectory, keyframes,
               points, point_observations, dense, lines, marks, line_evidence, pipes, building,
               occupancy] = map;
  return {id,
          source,
          method,
          complete,
          partial_reason,
          interrupted,
          warnings,
          verdict,
          rectified_rig,
          adjustment,
          given_poses,
          calibrated_rig,
          trajectory,
          keyframes,
          points,
          point_observations,
          dense,
          lines,
          marks,
          line_evidence,
          pipes,
          building,
          OccupancyMap(occupancy.resolution_m())};
}

}  // namespace

RigidTransform FrameOfExports(const MapResult& map) {
  if (IsFar(map.source)) return {};
  const double turn_rad = YawOfWorld(map.building.T_map_world);
  return {ExpRotation({0, 0, std::remainder(turn_rad, 0.5 * M_PI)}), Vector3d::Zero()};
}

bool IsInFrameOfExports(const Building& building) {
  return LogRotation(building.T_map_world.rotation).isZero(0) &&
         building.T_map_world.translation.isZero(0);
}

MapResult InFrameOfExports(const MapResult& map, const Progress& progress) {
  const RigidTransform T = FrameOfExports(map);
  MapResult turned = CopyOf(map);
  TurnContent(T, &turned);
  turned.occupancy = TurnedOccupancy(map.occupancy, T, progress);
  return turned;
}

}  // namespace slcmap
