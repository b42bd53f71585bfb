#include "export/triangulation.h"

#include <geos_c.h>

#include <algorithm>
#include <utility>

namespace slcmap {
namespace {

// A context of GEOS with its geometries, which must not outlive it. It is silent: what it refuses
// is told by nothing coming back.
class Geos {
 public:
  Geos() : context_(GEOS_init_r()) {}
  ~Geos() { GEOS_finish_r(context_); }
  Geos(const Geos&) = delete;
  Geos& operator=(const Geos&) = delete;

  GEOSContextHandle_t get() const { return context_; }

 private:
  GEOSContextHandle_t context_;
};

class Shape {
 public:
  Shape(const Geos& geos, GEOSGeometry* geometry) : geos_(&geos), geometry_(geometry) {}
  ~Shape() {
    if (geometry_ != nullptr) GEOSGeom_destroy_r(geos_->get(), geometry_);
  }
  Shape(const Shape&) = delete;
  Shape& operator=(const Shape&) = delete;

  const GEOSGeometry* get() const { return geometry_; }
  bool IsValid() const {
    return geometry_ != nullptr && GEOSisValid_r(geos_->get(), geometry_) == 1;
  }

 private:
  const Geos* geos_;
  GEOSGeometry* geometry_;
};

GEOSGeometry* RingOf(const Geos& geos, const PlanPoints& points) {
  const auto count = static_cast<unsigned>(points.size());
  GEOSCoordSequence* sequence = GEOSCoordSeq_create_r(geos.get(), count + 1, 2);
  for (unsigned i = 0; i <= count; ++i) {
    const Eigen::Vector2d& p = points[i % count];
    GEOSCoordSeq_setXY_r(geos.get(), sequence, i, p.x(), p.y());
  }
  return GEOSGeom_createLinearRing_r(geos.get(), sequence);
}

// nullptr of an outline that is none.
GEOSGeometry* ToGeos(const Geos& geos, const Polygon& polygon) {
  if (polygon.outline.size() < 3) return nullptr;
  std::vector<GEOSGeometry*> holes;
  for (const PlanPoints& hole : polygon.holes) {
    if (hole.size() >= 3) holes.push_back(RingOf(geos, hole));
  }
  return GEOSGeom_createPolygon_r(geos.get(), RingOf(geos, polygon.outline), holes.data(),
                                  static_cast<unsigned>(holes.size()));
}

PlanPoints PointsOf(const Geos& geos, const GEOSGeometry* ring) {
  const GEOSCoordSequence* sequence = GEOSGeom_getCoordSeq_r(geos.get(), ring);
  unsigned size = 0;
  GEOSCoordSeq_getSize_r(geos.get(), sequence, &size);
  PlanPoints points(size > 0 ? size - 1 : 0);
  for (unsigned i = 0; i + 1 < size; ++i) {
    GEOSCoordSeq_getXY_r(geos.get(), sequence, i, &points[i].x(), &points[i].y());
  }
  return points;
}

PlanPoints Oriented(PlanPoints points, bool counter_clockwise) {
  if ((SignedArea(points) > 0) != counter_clockwise) std::reverse(points.begin(), points.end());
  return points;
}

Polygon PolygonOf(const Geos& geos, const GEOSGeometry* part) {
  Polygon polygon;
  polygon.outline = Oriented(PointsOf(geos, GEOSGetExteriorRing_r(geos.get(), part)), true);
  const int holes = GEOSGetNumInteriorRings_r(geos.get(), part);
  for (int i = 0; i < holes; ++i) {
    const GEOSGeometry* ring = GEOSGetInteriorRingN_r(geos.get(), part, i);
    polygon.holes.push_back(Oriented(PointsOf(geos, ring), false));
  }
  return polygon;
}

// The polygons of a geometry of any kind.
std::vector<Polygon> PolygonsOf(const Geos& geos, const GEOSGeometry* geometry) {
  std::vector<Polygon> polygons;
  if (geometry == nullptr) return polygons;
  const int count = GEOSGetNumGeometries_r(geos.get(), geometry);
  for (int i = 0; i < count; ++i) {
    const GEOSGeometry* part = GEOSGetGeometryN_r(geos.get(), geometry, i);
    const bool is_area = GEOSGeomTypeId_r(geos.get(), part) == GEOS_POLYGON;
    if (is_area && !GEOSisEmpty_r(geos.get(), part)) polygons.push_back(PolygonOf(geos, part));
  }
  return polygons;
}

}  // namespace

std::vector<Polygon> Difference(const Polygon& polygon, const std::vector<PlanPoints>& areas) {
  const Geos geos;
  std::vector<Polygon> left = {polygon};
  for (const PlanPoints& area : areas) {
    const Shape taken(geos, ToGeos(geos, {area, {}}));
    if (!taken.IsValid()) continue;
    std::vector<Polygon> next;
    for (const Polygon& part : left) {
      const Shape whole(geos, ToGeos(geos, part));
      if (!whole.IsValid()) continue;
      const Shape rest(geos, GEOSDifference_r(geos.get(), whole.get(), taken.get()));
      for (Polygon& found : PolygonsOf(geos, rest.get())) next.push_back(std::move(found));
    }
    left = std::move(next);
  }
  return left;
}

std::vector<PlanTriangle> Triangulate(const Polygon& polygon) {
  const Geos geos;
  const Shape whole(geos, ToGeos(geos, polygon));
  if (!whole.IsValid()) return {};
  const Shape parts(geos, GEOSConstrainedDelaunayTriangulation_r(geos.get(), whole.get()));
  std::vector<PlanTriangle> triangles;
  for (const Polygon& part : PolygonsOf(geos, parts.get())) {
    if (part.outline.size() != 3) continue;
    triangles.push_back({part.outline[0], part.outline[1], part.outline[2]});
  }
  return triangles;
}

}  // namespace slcmap
