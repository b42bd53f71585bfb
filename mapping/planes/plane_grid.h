// A rectangle of square cells on a plane.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/core/mat.hpp>

namespace slcmap {

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
  int ColumnOf(const Eigen::Vector3d& p_world) const {
    return static_cast<int>(std::floor((u.dot(p_world) - from_u_m) / cell_m));
  }
  int RowOf(const Eigen::Vector3d& p_world) const {
    return static_cast<int>(std::floor((v.dot(p_world) - from_v_m) / cell_m));
  }
  bool Contains(int column, int row) const {
    return column >= 0 && row >= 0 && column < columns && row < rows;
  }
};

}  // namespace slcmap
