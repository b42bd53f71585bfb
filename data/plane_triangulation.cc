#include "data/plane_triangulation.h"

#include <functional>
#include <memory>

#include "data/geos.h"

namespace slcmap {
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

}  // namespace slcmap
