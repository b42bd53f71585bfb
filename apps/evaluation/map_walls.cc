#include "apps/evaluation/map_walls.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "data/option_table.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr OptionTable kWallsTable{
    Option{"max_distance_m", &MapWallOptions::max_distance_m, 1e-3, 1.0},
    Option{"max_angle_deg", &MapWallOptions::max_angle_deg, 0.1, 90.0}};

// A plane with the box around its outline, in axes along it.
class WallRegion {
 public:
  WallRegion(const BuildingPlane& plane, const MapWallOptions& options)
      : plane_(plane),
        options_(options),
        least_cosine_(std::cos(options.max_angle_deg * std::numbers::pi / 180)),
        along_(Vector3d::UnitZ().cross(plane.normal).normalized()) {
    for (const Vector3d& p : plane.outline_world) box_.extend(OnPlane(p));
  }

  bool Holds(const DensePoint& point) const {
    if (point.source != DenseSource::kStereo) return false;
    const double off_m = plane_.normal.dot(point.p_world) - plane_.offset_m;
    return std::abs(off_m) <= options_.max_distance_m &&
           plane_.normal.dot(point.normal_world) >= least_cosine_ &&
           box_.contains(OnPlane(point.p_world));
  }

 private:
  Eigen::Vector2d OnPlane(const Vector3d& p) const { return {along_.dot(p), p.z()}; }

  const BuildingPlane& plane_;
  const MapWallOptions& options_;
  const double least_cosine_;
  const Vector3d along_;
  Eigen::AlignedBox2d box_;
};

// The number of the wall that a plane is a face of, as plans have it; -1 where it is of none.
int64_t FindWall(const BuildingPlane& plane, const Building& building) {
  for (const PlanWall& wall : building.walls) {
    const auto& ids = wall.plane_ids;
    if (std::find(ids.begin(), ids.end(), plane.id) != ids.end()) return wall.id;
  }
  return -1;
}

}  // namespace

void MapWallOptions::Check() const { kWallsTable.Check("map_walls", *this); }

std::vector<SurveyedPoints> WallsOfMap(const Building& building,
                                       const std::vector<DensePoint>& cloud,
                                       const MapWallOptions& options) {
  options.Check();
  std::vector<SurveyedPoints> walls;
  for (const BuildingPlane& plane : building.planes) {
    if (plane.kind != PlaneKind::kWall) continue;
    const WallRegion region(plane, options);
    SurveyedPoints wall{FindWall(plane, building), (plane.offset_m + 1) * plane.normal, {}};
    for (const DensePoint& point : cloud) {
      if (!region.Holds(point)) continue;
      const Vector3d spread = point.sigma_m * point.normal_world;
      wall.points.push_back({point.p_world, spread * spread.transpose()});
    }
    if (!wall.points.empty()) walls.push_back(std::move(wall));
  }
  return walls;
}

}  // namespace slcmap
