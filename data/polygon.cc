#include "data/polygon.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "data/error.h"
#include "data/geos.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;

// Whether a ray from the point to the right crosses the outline an odd number of times.
bool Encloses(const PlanPoints& outline, const Vector2d& point) {
  bool inside = false;
  for (size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++) {
    const Vector2d &a = outline[i], &b = outline[j];
    if ((a.y() > point.y()) == (b.y() > point.y())) continue;
    const double x = a.x() + (point.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
    if (point.x() < x) inside = !inside;
  }
  return inside;
}

// Without points that are where the one before them is.
PlanPoints Apart(const PlanPoints& outline, double apart_m) {
  PlanPoints apart;
  for (const Vector2d& point : outline) {
    if (apart.empty() || (point - apart.back()).norm() > apart_m) apart.push_back(point);
  }
  while (apart.size() > 1 && (apart.front() - apart.back()).norm() <= apart_m) apart.pop_back();
  return apart;
}

// How far a point of an outline is off the straight line through those beside it; of a tip that
// these meet behind, zero.
double OffNeighbours_m(const PlanPoints& outline, size_t i) {
  const Vector2d& before = outline[(i + outline.size() - 1) % outline.size()];
  const Vector2d way = outline[(i + 1) % outline.size()] - before;
  const Vector2d off = outline[i] - before;
  const double cross = std::abs(way.x() * off.y() - way.y() * off.x());
  return cross > 0 ? cross / way.norm() : 0;
}

}  // namespace

double SignedArea(const PlanPoints& outline) {
  double twice = 0;
  for (size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++) {
    twice += outline[j].x() * outline[i].y() - outline[i].x() * outline[j].y();
  }
  return 0.5 * twice;
}

double Area(const Polygon& polygon) {
  double area = std::abs(SignedArea(polygon.outline));
  for (const PlanPoints& hole : polygon.holes) area -= std::abs(SignedArea(hole));
  return area;
}

double Perimeter(const PlanPoints& outline) {
  double length_m = 0;
  for (size_t i = 0; i < outline.size(); ++i) {
    length_m += (outline[(i + 1) % outline.size()] - outline[i]).norm();
  }
  return length_m;
}

double Perimeter(const Polygon& polygon) {
  double length_m = Perimeter(polygon.outline);
  for (const PlanPoints& hole : polygon.holes) length_m += Perimeter(hole);
  return length_m;
}

bool Contains(const Polygon& polygon, const Vector2d& point) {
  return Encloses(polygon.outline, point) &&
         std::none_of(polygon.holes.begin(), polygon.holes.end(),
                      [&](const PlanPoints& hole) { return Encloses(hole, point); });
}

std::vector<Polygon> ArrangementCells(const std::vector<PlanPoints>& chains, double grid_m) {
  Geos geos;
  std::vector<GEOSGeometry*> parts;
  for (const PlanPoints& chain : chains) {
    if (std::any_of(chain.begin(), chain.end(), [](const Vector2d& p) { return !p.allFinite(); })) {
      throw DataError("plan: found a point at infinity, expected finite coordinates");
    }
    if (chain.size() >= 2) parts.push_back(geos.Chain(chain));
  }
  const GEOSGeometry* lines = geos.Keep(geos.Collect(GEOS_MULTILINESTRING, parts));
  // Nodes the lines on the grid: without it, lines that cross in one place leave slivers there.
  const GEOSGeometry* noded = geos.Keep(GEOSUnaryUnionPrec_r(geos.context(), lines, grid_m));
  return geos.Polygons(geos.Keep(GEOSPolygonize_r(geos.context(), &noded, 1)));
}

std::vector<Polygon> Union(const std::vector<Polygon>& polygons, double grid_m) {
  Geos geos;
  std::vector<GEOSGeometry*> parts;
  for (const Polygon& polygon : polygons) parts.push_back(geos.ToGeos(polygon));
  const GEOSGeometry* all = geos.Keep(geos.Collect(GEOS_MULTIPOLYGON, parts));
  return geos.Polygons(geos.Keep(GEOSUnaryUnionPrec_r(geos.context(), all, grid_m)));
}

PlanPoints Straightened(const PlanPoints& outline, double straight_m, double apart_m) {
  PlanPoints corners = Apart(outline, apart_m);
  while (corners.size() > 3) {
    // One at a time: of two that are next to each other, one is the corner.
    size_t least = 0;
    double least_m = OffNeighbours_m(corners, 0);
    for (size_t i = 1; i < corners.size(); ++i) {
      const double off_m = OffNeighbours_m(corners, i);
      if (off_m < least_m) {
        least = i;
        least_m = off_m;
      }
    }
    if (least_m > straight_m) break;
    corners.erase(corners.begin() + static_cast<std::ptrdiff_t>(least));
  }
  return corners;
}

double IntersectionArea(const Polygon& a, const Polygon& b) {
  Geos geos;
  const GEOSGeometry* first = geos.Keep(geos.ToGeos(a));
  const GEOSGeometry* second = geos.Keep(geos.ToGeos(b));
  double area = 0;
  GEOSArea_r(geos.context(), geos.Keep(GEOSIntersection_r(geos.context(), first, second)), &area);
  return area;
}

}  // namespace slcmap
