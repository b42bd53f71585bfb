// What was measured of a plane's surface.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "data/map_line.h"
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
  // The points beside a plane that face as it does, and the lines at its border. Grid and cloud
  // outlive it.
  MeasuredAround(const PlaneGrid& grid, const std::vector<DensePoint>& cloud,
                 const std::vector<MapLine>& lines, const PlaneOptions& options);
  ~MeasuredAround();

  // The surface that most of the nearest points are on; none where they are on several.
  std::optional<SurfaceAround> At(double column, double row) const;

  // The plane itself, with the nearest point or place of a line in it; none where something else
  // was measured near before or behind it, or behind it no farther off, as a pane is.
  std::optional<SurfaceAround> OnPlane(double column, double row) const;

 private:
  struct Tree;

  const PlaneGrid& grid_;
  const std::vector<DensePoint>& cloud_;
  const PlaneOptions options_;
  std::vector<size_t> beside_;
  double grey_ = 0;  // of the points in the plane, in the mean
  // Of places along the plane: of all points beside it, of what is in it, of points off it, of
  // those well behind it.
  std::unique_ptr<Tree> tree_, in_plane_, off_plane_, behind_;
};

}  // namespace slcmap
