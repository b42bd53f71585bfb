// The planes of a building as square cells, with lines at which surfaces may end; and points of the
// dense cloud that lie on them, or fill them.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "data/io/map_line.h"
#include "mapping/map/building.h"
#include "mapping/map/map.h"
#include "mapping/surfaces/options.h"

namespace slcmap::inline mapping {

// The plane is normal . p = offset_m, in world; it is looked at from where its normal points to.
// Its axes u (columns) and v (rows) are square to the normal and to each other.
struct PlaneGrid {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ(), u = Eigen::Vector3d::UnitX(),
                  v = Eigen::Vector3d::UnitY();
  double offset_m = 0;
  double from_u_m = 0, from_v_m = 0;  // of the first cell's corner
  double cell_m = 0.05;
  int columns = 0, rows = 0;

  // Moves and sizes it to hold a box of u and v. Metres.
  void Cover(const Eigen::AlignedBox2d& box) {
    from_u_m = box.min().x();
    from_v_m = box.min().y();
    columns = std::max(1, static_cast<int>(std::ceil(box.sizes().x() / cell_m)));
    rows = std::max(1, static_cast<int>(std::ceil(box.sizes().y() / cell_m)));
  }

  // A place in units of cells; the middle of the first one is at (0.5, 0.5).
  Eigen::Vector3d At(double column, double row) const {
    return offset_m * normal + (from_u_m + column * cell_m) * u + (from_v_m + row * cell_m) * v;
  }
  double DistanceTo(const Eigen::Vector3d& p_world) const { return normal.dot(p_world) - offset_m; }
  int FindColumn(const Eigen::Vector3d& p_world) const {
    return static_cast<int>(std::floor((u.dot(p_world) - from_u_m) / cell_m));
  }
  int FindRow(const Eigen::Vector3d& p_world) const {
    return static_cast<int>(std::floor((v.dot(p_world) - from_v_m) / cell_m));
  }
  bool Contains(int column, int row) const {
    return column >= 0 && row >= 0 && column < columns && row < rows;
  }
};

// Lines on a plane, at which its surface may end.

class PlaneBorders {
 public:
  PlaneBorders() = default;  // part nothing
  // The lines along a plane, at most beside_m off it; but marks and pipes.
  PlaneBorders(const PlaneGrid& grid, const std::vector<MapLine>& lines, double beside_m);

  // Whether one of them is between two places, in units of cells (column, row).
  bool Part(const Eigen::Vector2d& a, const Eigen::Vector2d& b) const;

 private:
  struct Border {
    Eigen::Vector2d start, end;
  };
  std::vector<Border> borders_;
};

// The planes of a building as cells.

struct BoundedPlane {
  PlaneGrid grid;
  cv::Mat1b inside;    // by cell: not 0 within the outline, and in no opening
  double sigma_m = 0;  // of the plane's offset
  double reach_m = 0;  // how far from what was measured of it, it may be filled
  bool is_wall = false;
  bool is_measured = true;  // else its height is its storey's, and points on it are placed by what
                            // is measured around alone
};

// Of any kind of plane, with an outline of three points at least.
BoundedPlane BoundPlane(const BuildingPlane& plane, const Building& building,
                        const PlaneOptions& options);

// Walls as far as their outlines reach, without their openings; floors and ceilings over their
// rooms, without the holes in these.
std::vector<BoundedPlane> BoundedPlanes(const Building& building, const PlaneOptions& options);

// Draws points whose depth is uncertain to the wall, floor or ceiling that they lie on: a point at
// the distance d with the standard deviation s from a plane that surfaces follow to within p (of
// its offset, and surface_sigma_m) moves to d p^2 / (p^2 + s^2), the best of what stereo and the
// plane say. Points that face another way, are more than draw_sigmas off, or in an opening, stay.
// Of those that come to lie on a better known one the uncertain ones go. Planes that nobody
// measured draw nothing.
void SnapToPlanes(const Building& building, const PlaneOptions& options,
                  std::vector<DensePoint>* dense);

// To the map and, as patches of surfaces spacing_m wide, into its occupancy.
void AddFilledPoints(std::vector<DensePoint> filled, double spacing_m, MapResult* map);

}  // namespace slcmap::mapping
