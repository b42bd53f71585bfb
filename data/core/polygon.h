// Polygons of a plan, what is left of them and their triangles, and the arrangement of a plan's
// lines (GEOS). Metres, in the plane. Deterministic.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace slcmap::inline data {

using PlanPoints = std::vector<Eigen::Vector2d>;

// An outline, counter-clockwise, and the outlines of the holes in it, clockwise; none is closed by
// repeating its first point.
struct Polygon {
  PlanPoints outline;
  std::vector<PlanPoints> holes;
};

// What is enclosed, counter-clockwise positive.
double SignedArea(const PlanPoints& outline);

double Area(const Polygon& polygon);  // without the holes
double Perimeter(const PlanPoints& outline);
double Perimeter(const Polygon& polygon);  // with that of the holes
bool Contains(const Polygon& polygon, const Eigen::Vector2d& point);

// The cells that chains of points cut the plane into, without the outer one. Points come to lie on
// a grid: cells that meet have the same vertices along their border. Deterministic. Throws
// DataError for coordinates that are not finite.
std::vector<Polygon> ArrangementCells(const std::vector<PlanPoints>& chains, double grid_m);

// The union, as polygons that do not touch along a side, by the first point of their outline.
// Points come to lie on a grid.
std::vector<Polygon> Union(const std::vector<Polygon>& polygons, double grid_m);

// An outline without the points that are at most apart_m from the one before them, and without
// those that are at most straight_m off the straight line between the points beside them that stay.
// Three points stay, where there are as many.
PlanPoints Straightened(const PlanPoints& outline, double straight_m, double apart_m);

double IntersectionArea(const Polygon& a, const Polygon& b);

using PlanTriangle = std::array<Eigen::Vector2d, 3>;  // counter-clockwise

// A polygon without what the cuts enclose, which may touch each other and reach beyond its outline;
// none where nothing is left. Outlines may go either way round; of one that crosses itself it is
// what it encloses. Points come to lie on a grid. Throws DataError for coordinates that are not
// finite.
std::vector<Polygon> Difference(const Polygon& polygon, const std::vector<PlanPoints>& cuts,
                                double grid_m = 1e-6);

// The constrained Delaunay triangulation, which adds no points. As Difference otherwise.
std::vector<PlanTriangle> Triangulate(const Polygon& polygon);

}  // namespace slcmap::data
