// GEOS behind a class. Include in .cc files only.
#pragma once

#include <geos_c.h>

#include <algorithm>
#include <vector>

#include "data/error.h"
#include "data/polygon.h"

namespace slcmap {

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
  PlanPoints PointsOf(const GEOSGeometry* ring, bool counter_clockwise) const {
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
    polygon.outline = PointsOf(GEOSGetExteriorRing_r(context_, geometry), true);
    const int holes = GEOSGetNumInteriorRings_r(context_, geometry);
    for (int i = 0; i < holes; ++i) {
      polygon.holes.push_back(PointsOf(GEOSGetInteriorRingN_r(context_, geometry, i), false));
    }
    return polygon;
  }

  GEOSContextHandle_t context_;
  std::vector<GEOSGeometry*> owned_;
};

}  // namespace slcmap
