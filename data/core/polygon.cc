#include "data/core/polygon.h"

#include <geos_c.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "data/core/error.h"

namespace slcmap::inline data {

// One context of GEOS with the geometries that were made in it.
class Geos {
 public:
  Geos() : context_(GEOS_init_r()) {}
  ~Geos() {
    for (GEOSGeometry* geometry : owned_) GEOSGeom_destroy_r(context_, geometry);
    GEOS_finish_r(context_);
  }
  Geos(const Geos&) = delete;
  Geos& operator=(const Geos&) = delete;

  GEOSContextHandle_t context() const { return context_; }

  // What GEOS made, until the end; throws where it made nothing.
  const GEOSGeometry* Keep(GEOSGeometry* geometry) {
    if (geometry == nullptr) {
      throw DataError("plan: found lines that GEOS cannot arrange, expected polygons and chains");
    }
    owned_.push_back(geometry);
    return geometry;
  }

  GEOSGeometry* Chain(const PlanPoints& points) const {
    return GEOSGeom_createLineString_r(context_, Sequence(points, false));
  }

  GEOSGeometry* ToGeos(const Polygon& polygon) const {
    std::vector<GEOSGeometry*> holes;
    for (const PlanPoints& hole : polygon.holes) holes.push_back(Ring(hole));
    return GEOSGeom_createPolygon_r(context_, Ring(polygon.outline), holes.data(),
                                    static_cast<unsigned>(holes.size()));
  }

  GEOSGeometry* Collect(int type, std::vector<GEOSGeometry*> parts) const {
    return GEOSGeom_createCollection_r(context_, type, parts.data(),
                                       static_cast<unsigned>(parts.size()));
  }

  // All polygons of a geometry, by the first point of their outline.
  std::vector<Polygon> Polygons(const GEOSGeometry* geometry) const {
    std::vector<Polygon> polygons;
    const int count = GEOSGetNumGeometries_r(context_, geometry);
    for (int i = 0; i < count; ++i) {
      const GEOSGeometry* part = GEOSGetGeometryN_r(context_, geometry, i);
      if (GEOSGeomTypeId_r(context_, part) == GEOS_POLYGON && !GEOSisEmpty_r(context_, part)) {
        polygons.push_back(FromGeos(part));
      }
    }
    std::sort(polygons.begin(), polygons.end(), [](const Polygon& a, const Polygon& b) {
      const Eigen::Vector2d& p = a.outline.front();
      const Eigen::Vector2d& q = b.outline.front();
      return p.x() != q.x() ? p.x() < q.x() : p.y() < q.y();
    });
    return polygons;
  }

 private:
  GEOSCoordSequence* Sequence(const PlanPoints& points, bool closed) const {
    const size_t count = points.size() + (closed ? 1 : 0);
    GEOSCoordSequence* sequence = GEOSCoordSeq_create_r(context_, static_cast<unsigned>(count), 2);
    for (size_t i = 0; i < count; ++i) {
      const Eigen::Vector2d& point = points[i % points.size()];
      GEOSCoordSeq_setXY_r(context_, sequence, static_cast<unsigned>(i), point.x(), point.y());
    }
    return sequence;
  }

  GEOSGeometry* Ring(const PlanPoints& points) const {
    return GEOSGeom_createLinearRing_r(context_, Sequence(points, true));
  }

  // Begins at the least point, so that the same polygon is always told alike.
  PlanPoints CollectPoints(const GEOSGeometry* ring, bool counter_clockwise) const {
    const GEOSCoordSequence* sequence = GEOSGeom_getCoordSeq_r(context_, ring);
    unsigned size = 0;
    GEOSCoordSeq_getSize_r(context_, sequence, &size);
    PlanPoints points;
    for (unsigned i = 0; i + 1 < size; ++i) {
      Eigen::Vector2d point;
      GEOSCoordSeq_getXY_r(context_, sequence, i, &point.x(), &point.y());
      points.push_back(point);
    }
    if ((SignedArea(points) > 0) != counter_clockwise) std::reverse(points.begin(), points.end());
    const auto first = std::min_element(points.begin(), points.end(),
                                        [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
                                          return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
                                        });
    std::rotate(points.begin(), first, points.end());
    return points;
  }

  Polygon FromGeos(const GEOSGeometry* geometry) const {
    Polygon polygon;
    polygon.outline = CollectPoints(GEOSGetExteriorRing_r(context_, geometry), true);
    const int holes = GEOSGetNumInteriorRings_r(context_, geometry);
    for (int i = 0; i < holes; ++i) {
      polygon.holes.push_back(CollectPoints(GEOSGetInteriorRingN_r(context_, geometry, i), false));
    }
    return polygon;
  }

  GEOSContextHandle_t context_;
  std::vector<GEOSGeometry*> owned_;
};

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

namespace {

void RequireFinite(const PlanPoints& points) {
  if (std::all_of(points.begin(), points.end(), [](const auto& p) { return p.allFinite(); }))
    return;
  throw DataError("plane: found a point at infinity, expected finite coordinates");
}

// As an area, also where it crosses itself.
const GEOSGeometry* ValidArea(Polygon polygon, Geos* geos) {
  std::erase_if(polygon.holes, [](const PlanPoints& hole) { return hole.size() < 3; });
  RequireFinite(polygon.outline);
  for (const PlanPoints& hole : polygon.holes) RequireFinite(hole);
  const GEOSGeometry* area = geos->Keep(geos->ToGeos(polygon));
  // Parts without an area, as spikes, are left out: what mixes areas and lines cannot be cut.
  const std::unique_ptr<GEOSMakeValidParams, std::function<void(GEOSMakeValidParams*)>> how(
      GEOSMakeValidParams_create_r(geos->context()),
      [&](GEOSMakeValidParams* params) { GEOSMakeValidParams_destroy_r(geos->context(), params); });
  GEOSMakeValidParams_setMethod_r(geos->context(), how.get(), GEOS_MAKE_VALID_STRUCTURE);
  GEOSMakeValidParams_setKeepCollapsed_r(geos->context(), how.get(), 0);
  return geos->Keep(GEOSMakeValidWithParams_r(geos->context(), area, how.get()));
}

}  // namespace

std::vector<Polygon> Difference(const Polygon& polygon, const std::vector<PlanPoints>& cuts,
                                double grid_m) {
  if (polygon.outline.size() < 3) return {};
  Geos geos;
  const GEOSGeometry* rest = ValidArea(polygon, &geos);
  for (const PlanPoints& cut : cuts) {
    if (cut.size() < 3) continue;
    const GEOSGeometry* taken = ValidArea({cut, {}}, &geos);
    rest = geos.Keep(GEOSDifferencePrec_r(geos.context(), rest, taken, grid_m));
  }
  return geos.Polygons(rest);
}

std::vector<PlanTriangle> Triangulate(const Polygon& polygon) {
  if (polygon.outline.size() < 3) return {};
  Geos geos;
  const GEOSGeometry* area = ValidArea(polygon, &geos);
  std::vector<PlanTriangle> triangles;
  for (const Polygon& triangle :
       geos.Polygons(geos.Keep(GEOSConstrainedDelaunayTriangulation_r(geos.context(), area)))) {
    triangles.push_back({triangle.outline[0], triangle.outline[1], triangle.outline[2]});
  }
  return triangles;
}

}  // namespace slcmap::data
