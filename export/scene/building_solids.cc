#include "export/scene/building_solids.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "export/scene/meshes.h"

namespace slcmap::inline exporting {
namespace {

constexpr double kBeneathFloor_m = 0.15;  // lines along a floor's edge belong to it

}  // namespace

std::optional<std::size_t> StoreyAt(const Building& building, double height_m) {
  if (building.storeys.empty()) return std::nullopt;
  std::size_t storey = 0;
  for (std::size_t i = 1; i < building.storeys.size(); ++i) {
    if (building.storeys[i].floor_m - kBeneathFloor_m <= height_m) storey = i;
  }
  return storey;
}

std::optional<std::size_t> StoreyOfId(const Building& building, int64_t id) {
  for (std::size_t i = 0; i < building.storeys.size(); ++i) {
    if (building.storeys[i].id == id) return i;
  }
  return std::nullopt;
}

WallHeight HeightOfWall(const PlanWall& wall, const Building& building) {
  constexpr double kAssumed_m = 2.5;
  WallHeight height;
  if (const auto storey = StoreyOfId(building, wall.storey)) {
    const Storey& of_wall = building.storeys[*storey];
    height.floor_m = of_wall.floor_m;
    if (of_wall.ceiling_m) height.height_m = *of_wall.ceiling_m - of_wall.floor_m;
    if (of_wall.ceiling_m) return height;
  }
  for (const BuildingPlane& plane : building.planes) {
    if (std::find(wall.plane_ids.begin(), wall.plane_ids.end(), plane.id) == wall.plane_ids.end()) {
      continue;
    }
    for (const Eigen::Vector3d& p : plane.outline_world) {
      height.height_m = std::max(height.height_m, p.z() - height.floor_m);
    }
  }
  height.assumed = height.height_m < kLeastSolid_m;
  if (height.assumed) height.height_m = kAssumed_m;
  return height;
}

bool IsSolid(const PlanWall& wall, const WallHeight& height) {
  return (wall.end - wall.start).norm() > kLeastSolid_m && wall.thickness_m > kLeastSolid_m &&
         height.height_m > kLeastSolid_m;
}

std::optional<Eigen::AlignedBox2d> ComputeHole(const PlanOpening& opening, const PlanWall& wall,
                                               const WallHeight& height) {
  const Eigen::Vector2d least(std::max(0.0, opening.from_m), std::max(0.0, opening.sill_m));
  const Eigen::Vector2d most(std::min((wall.end - wall.start).norm(), opening.to_m),
                             std::min(height.height_m, opening.sill_m + opening.clear_height_m));
  if (!((most - least).minCoeff() > kLeastSolid_m)) return std::nullopt;
  return Eigen::AlignedBox2d(least, most);
}

namespace {

constexpr double kLeastSlabArea_m2 = 1e-4;

bool IsFloorOrCeiling(const BuildingPlane& plane) {
  return plane.kind == PlaneKind::kFloor || plane.kind == PlaneKind::kCeiling;
}

bool IsLevel(const BuildingPlane& plane) {
  return IsFloorOrCeiling(plane) && plane.normal.z() != 0;
}

double ComputeHeight(const BuildingPlane& plane) { return plane.offset_m / plane.normal.z(); }

// As wanted, or as much as leaves room for the slab of the floor above a ceiling, or of the ceiling
// beneath a floor, and for the rooms there.
double SlabThickness(const BuildingPlane& plane, const Polygon& polygon, const Building& building) {
  const bool is_floor = plane.kind == PlaneKind::kFloor;
  double thickness_m = kSlab_m;
  const auto keep_within = [&](double free_m, const Polygon& other) {
    if (free_m < kLeastSolid_m || free_m >= thickness_m) return;
    if (IntersectionArea(polygon, other) > kLeastSlabArea_m2) thickness_m = free_m;
  };
  for (const BuildingPlane& other : building.planes) {
    if (!IsLevel(other) || other.kind == plane.kind) continue;
    const double gap_m = (is_floor ? -1 : 1) * (ComputeHeight(other) - ComputeHeight(plane));
    keep_within(0.5 * gap_m, LevelOutline(other, building));
  }
  for (const Room& room : building.rooms) {
    if (is_floor && !room.height_m) continue;
    const double gap_m = is_floor ? ComputeHeight(plane) - room.floor_m - *room.height_m
                                  : room.floor_m - ComputeHeight(plane);
    keep_within(gap_m, room.polygon);
  }
  return thickness_m;
}

}  // namespace

bool HasArea(const Polygon& polygon) {
  return polygon.outline.size() >= 3 && Area(polygon) > kLeastSlabArea_m2;
}

std::vector<Slab> MakeSlabs(const Building& building, int* left_out) {
  std::vector<Slab> slabs;
  for (const BuildingPlane& plane : building.planes) {
    if (!IsFloorOrCeiling(plane)) continue;
    Slab slab = {&plane, LevelOutline(plane, building), 0, 0};
    if (!IsLevel(plane) || !HasArea(slab.polygon)) {
      if (left_out != nullptr) ++*left_out;
      continue;
    }
    const double thickness_m = SlabThickness(plane, slab.polygon, building);
    slab.low_m = ComputeHeight(plane) - (slab.IsFloor() ? thickness_m : 0);
    slab.high_m = slab.low_m + thickness_m;
    slabs.push_back(slab);
  }
  return slabs;
}

namespace {

using Eigen::Vector2d;

constexpr double kLeastLength_m = 1e-3, kLeastThickness_m = 1e-3;

WallSolid MakeSolid(const PlanWall& wall) {
  WallSolid solid;
  solid.wall = &wall;
  solid.start = wall.start;
  solid.end = wall.end;
  const double thickness_m = std::max(wall.thickness_m, kLeastThickness_m);
  solid.back_start = solid.At(0, thickness_m);
  solid.back_end = solid.At(solid.Length(), thickness_m);
  return solid;
}

double Cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// Where the backs of two walls meet, the second of which begins where the first ends.
std::optional<Vector2d> BackCorner(const WallSolid& first, const WallSolid& second) {
  constexpr double kLeastSine = 0.2;  // flatter corners have no clear one
  constexpr double kFarthest = 3;     // thicknesses from the corner
  const double sine = Cross(first.Direction(), second.Direction());
  if (std::abs(sine) < kLeastSine) return std::nullopt;
  const double along = Cross(second.back_start - first.back_end, second.Direction()) / sine;
  const Vector2d corner = first.back_end + along * first.Direction();
  const double reach_m = kFarthest * std::max(first.Thickness(), second.Thickness());
  if ((corner - first.end).norm() > reach_m) return std::nullopt;
  return corner;
}

// Whether a wall may end there behind: no opening of it is cut, nor the wall used up.
bool MayEndAt(const WallSolid& solid, const Vector2d& corner, bool at_start) {
  const double along_m = (corner - solid.start).dot(solid.Direction());
  double least_m = 0.5 * solid.Length(), most_m = least_m;
  for (const PlanOpening& opening : solid.wall->openings) {
    least_m = std::max(least_m, opening.to_m);
    most_m = std::min(most_m, opening.from_m);
  }
  return at_start ? along_m < most_m : along_m > least_m;
}

void JoinCorners(std::vector<WallSolid>* solids) {
  constexpr double kNear_m = 0.02;
  const std::vector<WallSolid> before = *solids;
  for (size_t i = 0; i < before.size(); ++i) {
    for (size_t j = 0; j < before.size(); ++j) {
      if (i == j || (before[i].end - before[j].start).norm() > kNear_m) continue;
      const std::optional<Vector2d> corner = BackCorner(before[i], before[j]);
      if (!corner || !MayEndAt(before[i], *corner, false) || !MayEndAt(before[j], *corner, true)) {
        continue;
      }
      (*solids)[i].back_end = *corner;
      (*solids)[j].back_start = *corner;
      break;
    }
  }
}

bool IsNear(const Vector2d& point, const Vector2d& start, const Vector2d& end) {
  constexpr double kNear_m = 1e-3;
  const Vector2d along = end - start;
  const double at = std::clamp((point - start).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (start + at * along - point).norm() < kNear_m;
}

void AddEdges(const std::vector<WallSolid>& solids, const PlanPoints& ring,
              std::vector<WallEdge>* edges) {
  for (size_t i = 0; i < ring.size(); ++i) {
    const Vector2d &start = ring[i], &end = ring[(i + 1) % ring.size()];
    edges->push_back({start, end, IsAssumedBorder(solids, 0.5 * (start + end))});
  }
}

}  // namespace

std::vector<std::pair<double, double>> Intervals(const WallSolid& solid) {
  std::vector<PlanOpening> openings = solid.wall->openings;
  std::sort(openings.begin(), openings.end(),
            [](const PlanOpening& a, const PlanOpening& b) { return a.from_m < b.from_m; });
  std::vector<std::pair<double, double>> stretches;
  double from_m = 0;
  for (const PlanOpening& opening : openings) {
    const double to_m = std::min(opening.from_m, solid.Length());
    if (to_m - from_m > kLeastLength_m) stretches.emplace_back(from_m, to_m);
    from_m = std::max(from_m, opening.to_m);
  }
  if (solid.Length() - from_m > kLeastLength_m) stretches.emplace_back(from_m, solid.Length());
  return stretches;
}

Polygon MakePiece(const WallSolid& solid, double from_m, double to_m) {
  const double behind_m = solid.Thickness();
  const Vector2d back_from = from_m == 0 ? solid.back_start : solid.At(from_m, behind_m);
  const Vector2d back_to = to_m == solid.Length() ? solid.back_end : solid.At(to_m, behind_m);
  return {{solid.At(from_m, 0), solid.At(to_m, 0), back_to, back_from}, {}};
}

std::vector<WallSolid> WallSolids(const Building& building, int64_t storey) {
  std::vector<WallSolid> solids;
  for (const PlanWall& wall : building.walls) {
    if (wall.storey != storey || (wall.end - wall.start).norm() < kLeastLength_m) continue;
    solids.push_back(MakeSolid(wall));
  }
  JoinCorners(&solids);
  return solids;
}

std::map<const PlanWall*, WallSolid> SolidsOfWalls(const Building& building) {
  std::set<int64_t> storeys;
  for (const PlanWall& wall : building.walls) storeys.insert(wall.storey);
  std::map<const PlanWall*, WallSolid> solids;
  for (const int64_t storey : storeys) {
    for (const WallSolid& solid : WallSolids(building, storey)) solids[solid.wall] = solid;
  }
  return solids;
}

WallBack ComputeBack(const PlanWall& wall, const std::map<const PlanWall*, WallSolid>& solids) {
  const auto found = solids.find(&wall);
  if (found == solids.end()) return {};
  const WallSolid& solid = found->second;
  WallBack back = {(solid.start - solid.back_start).dot(solid.Direction()),
                   (solid.back_end - solid.end).dot(solid.Direction())};
  for (const PlanOpening& opening : solid.wall->openings) {
    if (opening.from_m < kLeastLength_m) back.before_start_m = 0;
    if (opening.to_m > solid.Length() - kLeastLength_m) back.beyond_end_m = 0;
  }
  return back;
}

bool IsAssumedBorder(const std::vector<WallSolid>& solids, const Vector2d& point) {
  bool on_assumed = false;
  for (const WallSolid& solid : solids) {
    if (IsNear(point, solid.start, solid.end)) return false;
    if (!IsNear(point, solid.back_start, solid.back_end)) continue;
    if (!solid.wall->thickness_assumed) return false;
    on_assumed = true;
  }
  return on_assumed;
}

std::vector<Polygon> WallAreas(const std::vector<WallSolid>& solids) {
  std::vector<Polygon> pieces;
  for (const WallSolid& solid : solids) {
    for (const auto& [from_m, to_m] : Intervals(solid)) {
      pieces.push_back(MakePiece(solid, from_m, to_m));
    }
  }
  std::vector<Polygon> areas = Union(pieces, kOutlineGrid_m);
  for (Polygon& area : areas) {
    std::erase_if(area.holes, [&](const PlanPoints& hole) {
      return std::abs(SignedArea(hole)) < kLeastHole_m2;
    });
  }
  return areas;
}

std::vector<WallEdge> WallEdges(const std::vector<WallSolid>& solids) {
  std::vector<WallEdge> edges;
  for (const Polygon& area : WallAreas(solids)) {
    AddEdges(solids, area.outline, &edges);
    for (const PlanPoints& hole : area.holes) AddEdges(solids, hole, &edges);
  }
  return edges;
}

Eigen::AlignedBox2d PlanExtent(const Building& building) {
  Eigen::AlignedBox2d extent;
  for (const Storey& storey : building.storeys) {
    for (const WallSolid& solid : WallSolids(building, storey.id)) {
      for (const Vector2d& p : {solid.start, solid.end, solid.back_start, solid.back_end}) {
        extent.extend(p);
      }
    }
  }
  for (const Room& room : building.rooms) {
    for (const Vector2d& point : room.polygon.outline) extent.extend(point);
  }
  return extent;
}

}  // namespace slcmap::exporting
