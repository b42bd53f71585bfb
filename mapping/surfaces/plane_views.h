// What measured rays and points say of a plane's surface, and whether any view looks at a place of
// it.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "data/io/map_line.h"
#include "mapping/lines/line_samples.h"
#include "mapping/map/building.h"
#include "mapping/map/map.h"
#include "mapping/map/point_index.h"
#include "mapping/surfaces/bounded_plane.h"
#include "mapping/surfaces/options.h"
#include "mapping/views/view.h"

namespace slcmap::inline mapping {

// By cell: the rays that go through it to an end clearly behind it, from either side.
cv::Mat1i CountPasses(const PlaneGrid& grid, const std::vector<ViewRays>& rays);

// The left images of a rig's views. What is given has to live on.
class PlaneWatch {
 public:
  // Hidden is what one of the depths hides.
  PlaneWatch(const ViewCameras& cameras, const std::vector<VisibilityDepths>& depths);

  // From before the surface, near and steeply enough, past all that hides it. Neighbouring places
  // are seen by the same view, which is asked first.
  bool Sees(const Eigen::Vector3d& p_world, const Eigen::Vector3d& normal_world);

 private:
  bool SeesFrom(int view, const Eigen::Vector3d& p_world,
                const Eigen::Vector3d& normal_world) const;

  const ViewCameras& cameras_;
  const std::vector<VisibilityDepths>& depths_;
  std::vector<Eigen::Vector3d> centres_;
  int last_ = 0;
};

// A surface around a place of a plane.
struct SurfaceAround {
  Eigen::Vector2d nearest = Eigen::Vector2d::Zero();  // of its points, in units of cells
  double nearest_m = 0;                               // along the plane, to that
  double offset_m = 0;  // of the surface from the plane, along its normal
  double grey = 0;
};

class MeasuredAround {
 public:
  // The measured points beside a plane that face as it does, and the lines at its border. Grid and
  // cloud outlive it.
  MeasuredAround(const PlaneGrid& grid, const std::vector<DensePoint>& cloud,
                 const std::vector<MapLine>& lines, double beside_m);

  // The surface that most of the nearest points are on; none where they are on several.
  std::optional<SurfaceAround> At(double column, double row) const;

  // The plane itself, with the nearest point or place of a line in it; none where something else
  // was measured near before or behind it, or behind it no farther off, as a pane is.
  std::optional<SurfaceAround> OnPlane(double column, double row) const;

 private:
  const PlaneGrid& grid_;
  const std::vector<DensePoint>& cloud_;
  std::vector<size_t> beside_;
  double grey_ = 0;  // of the points in the plane, in the mean
  // Along the plane: of all points beside it, of what is in it, of points off it, of those well
  // behind it.
  std::vector<Eigen::Vector3f> places_, in_plane_;
  std::unique_ptr<const PointTree> places_tree_, in_plane_tree_, off_plane_tree_, behind_tree_;
};

}  // namespace slcmap::mapping
