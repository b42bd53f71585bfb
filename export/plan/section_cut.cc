#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>

#include "export/plan/section_drawing.h"
#include "export/scene/building_solids.h"

namespace slcmap::inline exporting {
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
    for (const auto& [from_m, to_m] : Intervals(solid)) AddWall(wall, from_m, to_m, low_m, high_m);
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
      for (const auto& [from_m, to_m] : RangesIn(room.polygon, view_)) {
        cut_.rooms.push_back({&room, from_m, to_m});
      }
    }
  }

  void CutSlabs() {
    for (const Slab& slab : MakeSlabs(building_)) {
      if (!view_.Shows(slab.plane->storey)) continue;
      for (const CutRange& range : RangesIn(slab.polygon, view_)) {
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
    cut_.boxes.push_back(
        {{Vector2d(range.first, low_m), Vector2d(range.second, high_m)}, true, sides});
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
  std::vector<Polygon> polygons;
  for (const CutBox& cut : boxes) {
    if (with_assumed || !cut.is_assumed) polygons.push_back(AsPolygon(cut.box));
  }
  return Union(polygons, kOutlineGrid_m);
}

}  // namespace

SectionCut MakeCut(const Building& building, const std::vector<TallWall>& walls,
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

namespace {

using Eigen::Vector3d;

constexpr double kAtEdge_m = 1e-4;  // what lies on the border of a screen is seen

double DepthAt(const Screen& screen, double x_m) {
  const double width_m = screen.box.sizes().x();
  const double share = width_m > 0 ? (x_m - screen.box.min().x()) / width_m : 0;
  return screen.left_m + share * (screen.right_m - screen.left_m);
}

// The part within a window.
std::optional<ViewedLine> Clipped(ViewedLine line, const Eigen::AlignedBox3d& window) {
  const Vector3d along = line.end - line.start;
  double from = 0, to = 1;
  for (int k = 0; k < 3; ++k) {
    const double low = window.min()[k] - line.start[k], high = window.max()[k] - line.start[k];
    if (along[k] == 0) {
      if (low > 0 || high < 0) return std::nullopt;
      continue;
    }
    from = std::max(from, std::min(low / along[k], high / along[k]));
    to = std::min(to, std::max(low / along[k], high / along[k]));
  }
  if (!(from < to)) return std::nullopt;
  line.end = line.start + to * along;
  line.start += from * along;
  return line;
}

// Where along a line, 0 to 1, a screen may begin or cease to hide it.
void AddChanges(const Screen& screen, const ViewedLine& line, std::vector<double>* changes) {
  const Vector3d along = line.end - line.start;
  for (int k = 0; k < 2; ++k) {
    if (along[k] == 0) continue;
    for (const double at : {screen.box.min()[k], screen.box.max()[k]}) {
      changes->push_back((at - line.start[k]) / along[k]);
    }
  }
  const double start_m = line.start.z() - line.before_m - DepthAt(screen, line.start.x());
  const double end_m = line.end.z() - line.before_m - DepthAt(screen, line.end.x());
  if (start_m != end_m) changes->push_back(start_m / (start_m - end_m));
}

bool MayHide(const Screen& screen, const ViewedLine& line) {
  Eigen::AlignedBox2d box(line.start.head<2>());
  box.extend(line.end.head<2>().eval());
  return screen.box.intersects(box) && std::min(screen.left_m, screen.right_m) <
                                           std::max(line.start.z(), line.end.z()) - line.before_m;
}

using SharesOfLine = std::vector<std::pair<double, double>>;

SharesOfLine SeenShares(const ViewedLine& line, const std::vector<Screen>& screens) {
  constexpr double kLeast = 1e-6;
  std::vector<double> changes = {0, 1};
  std::vector<Screen> before;
  for (const Screen& screen : screens) {
    if (!MayHide(screen, line)) continue;
    before.push_back(screen);
    AddChanges(screen, line, &changes);
  }
  std::erase_if(changes, [](double share) { return !(share >= 0 && share <= 1); });
  std::sort(changes.begin(), changes.end());
  SharesOfLine seen;
  for (size_t i = 0; i + 1 < changes.size(); ++i) {
    if (changes[i + 1] - changes[i] < kLeast) continue;
    const double middle = 0.5 * (changes[i] + changes[i + 1]);
    const Vector3d point = line.start + middle * (line.end - line.start);
    if (IsHidden(before, point, line.before_m)) continue;
    if (!seen.empty() && changes[i] - seen.back().second < kLeast) {
      seen.back().second = changes[i + 1];
    } else {
      seen.emplace_back(changes[i], changes[i + 1]);
    }
  }
  return seen;
}

// Level and upright pieces by their pen, direction and place across it, others as they are.
class Pieces {
 public:
  void Add(Pen pen, const Vector2d& start, const Vector2d& end) {
    constexpr double kLeast_m = 1e-3, kGrid_m = 1e-4;
    if ((end - start).norm() < kLeast_m) return;
    for (const int along : {0, 1}) {
      const int across = 1 - along;
      if (std::abs(end[across] - start[across]) > kGrid_m) continue;
      const int64_t row = std::llround(start[across] / kGrid_m);
      rows_[{pen, along, row}].push_back({start, end});
      if (start[along] > end[along])
        std::swap(rows_[{pen, along, row}].back()[0], rows_[{pen, along, row}].back()[1]);
      return;
    }
    paths_.push_back({pen, {start, end}});
  }

  std::vector<DrawnPath> Joined() && {
    for (auto& [key, row] : rows_) {
      const auto [pen, along, place] = key;
      std::sort(row.begin(), row.end(),
                [k = along](const Piece& a, const Piece& b) { return a[0][k] < b[0][k]; });
      Piece joined = row.front();
      for (const Piece& piece : row) {
        if (piece[0][along] > joined[1][along] + kAtEdge_m) {
          paths_.push_back({pen, {joined[0], joined[1]}});
          joined = piece;
        }
        if (piece[1][along] > joined[1][along]) joined[1] = piece[1];
      }
      paths_.push_back({pen, {joined[0], joined[1]}});
    }
    return std::move(paths_);
  }

 private:
  using Piece = std::array<Vector2d, 2>;
  std::map<std::tuple<Pen, int, int64_t>, std::vector<Piece>> rows_;
  std::vector<DrawnPath> paths_;
};

}  // namespace

bool IsHidden(const std::vector<Screen>& screens, const Vector3d& point, double before_m) {
  return std::any_of(screens.begin(), screens.end(), [&](const Screen& screen) {
    const Vector2d inside =
        (point.head<2>() - screen.box.min()).cwiseMin(screen.box.max() - point.head<2>());
    return inside.minCoeff() > kAtEdge_m && DepthAt(screen, point.x()) < point.z() - before_m;
  });
}

std::vector<DrawnPath> SeenParts(const std::vector<ViewedLine>& lines,
                                 const std::vector<Screen>& screens,
                                 const Eigen::AlignedBox3d& window) {
  Pieces pieces;
  for (const ViewedLine& whole : lines) {
    const std::optional<ViewedLine> line = Clipped(whole, window);
    if (!line) continue;
    const Vector3d along = line->end - line->start;
    for (const auto& [from, to] : SeenShares(*line, screens)) {
      pieces.Add(line->pen, (line->start + from * along).head<2>(),
                 (line->start + to * along).head<2>());
    }
  }
  return std::move(pieces).Joined();
}

}  // namespace slcmap::exporting
