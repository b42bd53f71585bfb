// What was measured of a plane's surface.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "mapping/dense/dense_point.h"
#include "mapping/planes/plane_grid.h"
#include "mapping/planes/plane_options.h"

namespace slcmap {

// A surface around a place of a plane.
struct SurfaceAround {
  Eigen::Vector2d nearest = Eigen::Vector2d::Zero();  // of its points, in units of cells
  double nearest_m = 0;                               // along the plane, to that
  double offset_m = 0;  // of the surface from the plane, along its normal
  double grey = 0;
};

class MeasuredAround {
 public:
  // The points beside a plane that face as it does. Grid and cloud outlive it.
  MeasuredAround(const PlaneGrid& grid, const std::vector<DensePoint>& cloud,
                 const PlaneOptions& options);
  ~MeasuredAround();

  // The surface that most of the nearest points are on; none where they are on several.
  std::optional<SurfaceAround> At(double column, double row) const;

 private:
  const PlaneGrid& grid_;
  const std::vector<DensePoint>& cloud_;
  const PlaneOptions options_;
  std::vector<size_t> beside_;
  struct Tree;
  std::unique_ptr<Tree> tree_;  // of their places along the plane
};

}  // namespace slcmap
