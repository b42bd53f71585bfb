#include "data/plane_triangulation.h"

#include "data/geos.h"

namespace slcmap {
namespace {

// An outline as an area, also where it crosses itself.
const GEOSGeometry* ValidArea(const PlanPoints& outline, Geos* geos) {
  if (std::any_of(outline.begin(), outline.end(),
                  [](const Eigen::Vector2d& p) { return !p.allFinite(); })) {
    throw DataError("plane: found a point at infinity, expected finite coordinates");
  }
  const GEOSGeometry* area = geos->Keep(geos->ToGeos({outline, {}}));
  return geos->Keep(GEOSMakeValid_r(geos->context(), area));
}

}  // namespace

std::vector<PlanTriangle> Triangulate(const PlanPoints& outline,
                                      const std::vector<PlanPoints>& cuts, double grid_m) {
  if (outline.size() < 3) return {};
  Geos geos;
  const GEOSGeometry* rest = ValidArea(outline, &geos);
  for (const PlanPoints& cut : cuts) {
    if (cut.size() < 3) continue;
    rest = geos.Keep(GEOSDifferencePrec_r(geos.context(), rest, ValidArea(cut, &geos), grid_m));
  }
  std::vector<PlanTriangle> triangles;
  for (const Polygon& triangle :
       geos.Polygons(geos.Keep(GEOSConstrainedDelaunayTriangulation_r(geos.context(), rest)))) {
    triangles.push_back({triangle.outline[0], triangle.outline[1], triangle.outline[2]});
  }
  return triangles;
}

}  // namespace slcmap
