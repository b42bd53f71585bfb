#include "export/section/section_cut.h"

#include <algorithm>
#include <cmath>

#include "export/slab_shape.h"

namespace slcmap {
namespace {

using Eigen::AlignedBox2d;
using Eigen::Vector2d;

using CutRange = std::pair<double, double>;

// From left to right, where the plane is in a polygon.
std::vector<CutRange> RangesIn(const Polygon& polygon, const SectionView& view) {
  std::vector<double> places;
  const auto add = [&](const PlanPoints& ring) {
    for (size_t i = 0; i < ring.size(); ++i) {
      const Vector2d a = view.At(ring[i]), b = view.At(ring[(i + 1) % ring.size()]);
      if ((a.y() < 0) == (b.y() < 0)) continue;
      places.push_back(a.x() + (b.x() - a.x()) * a.y() / (a.y() - b.y()));
    }
  };
  add(polygon.outline);
  for (const PlanPoints& hole : polygon.holes) add(hole);
  std::sort(places.begin(), places.end());
  std::vector<CutRange> ranges;
  for (size_t i = 0; i + 1 < places.size(); i += 2) {
    const double from_m = std::max(places[i], view.from_m);
    const double to_m = std::min(places[i + 1], view.to_m);
    if (to_m - from_m > kLeastSolid_m) ranges.emplace_back(from_m, to_m);
  }
  return ranges;
}

// Left and right: where neither its face is, nor a back that was seen.
std::array<bool, 4> AssumedSides(const TallWall& wall, const CutRange& range,
                                 const SectionView& view) {
  constexpr double kNear_m = 2e-3;
  std::array<bool, 4> assumed = {false, false, false, wall.height.assumed};
  if (!wall.solid.wall->thickness_assumed) return assumed;
  const Vector2d a = view.At(wall.solid.start), b = view.At(wall.solid.end);
  const double face_m = a.x() + (b.x() - a.x()) * a.y() / (a.y() - b.y());
  assumed[0] = !(std::abs(range.first - face_m) < kNear_m);
  assumed[1] = !(std::abs(range.second - face_m) < kNear_m);
  return assumed;
}

// As thick as is assumed, but no farther than half way to the next storey.
double SlabBetween(const Building& building, double floor_m, bool below) {
  double slab_m = kSlab_m;
  for (const Storey& storey : building.storeys) {
    const double other_m = below ? storey.ceiling_m.value_or(floor_m) : storey.floor_m;
    const double gap_m = below ? floor_m - other_m : other_m - floor_m;
    if (gap_m > kLeastSolid_m) slab_m = std::min(slab_m, 0.5 * gap_m);
  }
  return slab_m;
}

class BuildingCutter {
 public:
  BuildingCutter(const Building& building, const SectionView& view)
      : building_(building), view_(view) {}

  void CutWallAndOpenings(const TallWall& wall) {
    const WallSolid& solid = wall.solid;
    const double low_m = wall.height.floor_m, high_m = wall.Top_m();
    for (const CutRange& range : RangesIn(MakePiece(solid, 0, solid.Length()), view_)) {
      cut_.walls.push_back({solid.wall, BoxOfWall(wall, range, low_m, high_m)});
      const double under_m = SlabBetween(building_, low_m, true);
      AddAssumed(range, low_m - under_m, low_m);
      if (HasCeiling(solid.wall->storey)) {
        AddAssumed(range, high_m, high_m + SlabBetween(building_, high_m, false));
      }
    }
    for (const auto& [from_m, to_m] : Stretches(solid)) AddWall(wall, from_m, to_m, low_m, high_m);
    for (const PlanOpening& opening : solid.wall->openings) {
      const std::optional<AlignedBox2d> hole = wall.Hole(opening);
      if (!hole) continue;
      const double from_m = hole->min().x(), to_m = hole->max().x();
      AddWall(wall, from_m, to_m, low_m, hole->min().y());
      AddWall(wall, from_m, to_m, hole->max().y(), high_m);
      for (const CutRange& range : RangesIn(MakePiece(solid, from_m, to_m), view_)) {
        cut_.openings.push_back(
            {&opening,
             {Vector2d(range.first, hole->min().y()), Vector2d(range.second, hole->max().y())},
             true});
      }
    }
  }

  void CutRooms() {
    for (const Room& room : building_.rooms) {
      if (!view_.Shows(room.storey)) continue;
      for (const auto& [from_m, to_m] : RangesIn(RoomInPlan(building_, room), view_)) {
        cut_.rooms.push_back({&room, from_m, to_m});
      }
    }
  }

  void CutSlabs() {
    for (Slab& slab : SlabsOf(building_, kSlab_m)) {
      if (!view_.Shows(slab.plane->storey)) continue;
      Room as_room;
      as_room.polygon = std::move(slab.polygon);
      for (const CutRange& range : RangesIn(RoomInPlan(building_, as_room), view_)) {
        const bool is_floor = slab.IsFloor();
        AddAssumed(IntoWalls(range), slab.low_m, slab.high_m, {true, true, is_floor, !is_floor});
      }
    }
  }

  SectionCut Take() && { return std::move(cut_); }

 private:
  bool HasCeiling(int64_t storey) const {
    return std::any_of(building_.storeys.begin(), building_.storeys.end(),
                       [&](const Storey& s) { return s.id == storey && s.ceiling_m.has_value(); });
  }

  // A slab goes on under and over the walls that it ends at, whose faces are not quite the border
  // of their room.
  CutRange IntoWalls(CutRange range) const {
    constexpr double kAtWall_m = 0.02;
    for (const CutWall& wall : cut_.walls) {
      const AlignedBox2d& box = wall.cut.box;
      if (std::abs(range.first - box.max().x()) < kAtWall_m) range.first = box.center().x();
      if (std::abs(range.second - box.min().x()) < kAtWall_m) range.second = box.center().x();
    }
    return range;
  }

  CutBox BoxOfWall(const TallWall& wall, const CutRange& range, double low_m, double high_m) const {
    return {{Vector2d(range.first, low_m), Vector2d(range.second, high_m)},
            wall.solid.wall->thickness_assumed,
            AssumedSides(wall, range, view_)};
  }

  void AddWall(const TallWall& wall, double from_m, double to_m, double low_m, double high_m) {
    if (high_m - low_m < kLeastSolid_m) return;
    for (const CutRange& range : RangesIn(MakePiece(wall.solid, from_m, to_m), view_)) {
      cut_.boxes.push_back(BoxOfWall(wall, range, low_m, high_m));
    }
  }

  void AddAssumed(const CutRange& range, double low_m, double high_m,
                  const std::array<bool, 4>& sides = {true, true, true, true}) {
    if (high_m - low_m < kLeastSolid_m) return;
    cut_.boxes.push_back({{Vector2d(range.first, low_m), Vector2d(range.second, high_m)},
                          true,
                          sides});
  }

  const Building& building_;
  const SectionView& view_;
  SectionCut cut_;
};

Polygon AsPolygon(const AlignedBox2d& box) {
  const Vector2d &low = box.min(), &high = box.max();
  return {{low, {high.x(), low.y()}, high, {low.x(), high.y()}}, {}};
}

// Whether a point of the border of what is cut is on no side that was seen.
bool IsOnAssumedSide(const std::vector<CutBox>& boxes, const Vector2d& point) {
  constexpr double kNear_m = 1e-4;
  return std::none_of(boxes.begin(), boxes.end(), [&](const CutBox& cut) {
    if (cut.box.exteriorDistance(point) > kNear_m) return false;
    const Vector2d low = point - cut.box.min(), high = cut.box.max() - point;
    const double away_m[] = {low.x(), high.x(), low.y(), high.y()};
    for (size_t side = 0; side < std::size(away_m); ++side) {
      if (std::abs(away_m[side]) < kNear_m && !cut.assumed_sides[side]) return true;
    }
    return false;
  });
}

std::vector<Polygon> CutAreas(const std::vector<CutBox>& boxes, bool with_assumed) {
  constexpr double kGrid_m = 1e-5;
  std::vector<Polygon> polygons;
  for (const CutBox& cut : boxes) {
    if (with_assumed || !cut.is_assumed) polygons.push_back(AsPolygon(cut.box));
  }
  return Union(polygons, kGrid_m);
}

}  // namespace

SectionCut CutOf(const Building& building, const std::vector<TallWall>& walls,
                 const SectionView& view) {
  BuildingCutter cutter(building, view);
  for (const TallWall& wall : walls) cutter.CutWallAndOpenings(wall);
  cutter.CutRooms();
  cutter.CutSlabs();
  return std::move(cutter).Take();
}

Drawing DrawCut(const std::vector<CutBox>& boxes) {
  constexpr double kLeastStep_m = 2e-3;  // of a room's ceiling beside that of its storey
  Drawing drawing;
  for (const Polygon& area : CutAreas(boxes, true)) {
    drawing.areas.push_back({Fill::kAssumed, area});
    std::vector<PlanPoints> rings = area.holes;
    rings.push_back(area.outline);
    for (const PlanPoints& ring : rings) {
      for (size_t i = 0; i < ring.size(); ++i) {
        const Vector2d &start = ring[i], &end = ring[(i + 1) % ring.size()];
        if ((end - start).norm() < kLeastStep_m) continue;
        const bool assumed = IsOnAssumedSide(boxes, 0.5 * (start + end));
        drawing.paths.push_back({assumed ? Pen::kAssumed : Pen::kWall, {start, end}});
      }
    }
  }
  for (const Polygon& area : CutAreas(boxes, false)) drawing.areas.push_back({Fill::kWall, area});
  return drawing;
}

}  // namespace slcmap
