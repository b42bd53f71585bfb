// Everything dense of a map: depth of the views, their agreement, and one cloud; and which cells of
// space that depth shows to be free, and which to be occupied.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <vector>

#include "data/core/progress.h"
#include "data/core/types.h"
#include "mapping/dense/depth_refinement.h"
#include "mapping/map/building.h"
#include "mapping/map/map.h"
#include "mapping/map/occupancy_map.h"
#include "mapping/map/options.h"
#include "mapping/views/stereo_depth.h"
#include "mapping/views/view.h"

namespace slcmap::inline mapping {

// Cells are cubes of an octree, cell (0, 0, 0) from the origin of the world on.
class DepthCarver {
 public:
  // Throws ConfigError where the cells around a camera, up to max_range_m, would take too much
  // memory.
  DepthCarver(double resolution_m, double max_range_m);

  // Follows the rays of the known nodes. Free is what a ray passes up to three standard deviations
  // before its depth, at most max_range_m far; occupied are the cells at the depths within that
  // range, which beat free ones. A cell counts once, however many rays pass it.
  CellObservation Observe(const RigidTransform& T_world_camera, const Camera& camera,
                          const DepthGrid& grid) const;

 private:
  // How far the rays of the known nodes go, up to max_range_m.
  double Reach_m(const Camera& camera, const DepthGrid& grid) const;

  const double resolution_m_, max_range_m_;
};

// Makes the cells of surfaces occupied, and those half a cell behind them, whatever single views
// said of these. Each point stands for a patch of its surface that is spacing_m wide. Inner cells
// of the tree know of it after OccupancyMap::Finish().
void MarkSurfaces(const std::vector<DensePoint>& points, double spacing_m, OccupancyMap* map);

class DepthOccupancy {
 public:
  // Throws ConfigError where the resolution would take too much memory.
  explicit DepthOccupancy(const OccupancyOptions& options);

  // A view's confirmed depth: one observation of each cell that it tells of. Cells out of the
  // octree are left out and counted.
  void Add(const RigidTransform& T_world_camera, const Camera& camera, const DepthGrid& depth);

  // The map once all views are in, with the surfaces fused of them marked.
  OccupancyMap Finish(const std::vector<DensePoint>& points, double spacing_m);

  int64_t out_of_octree() const { return out_of_octree_; }

 private:
  const DepthCarver carver_;
  OccupancyMap map_;
  int64_t out_of_octree_ = 0;
};

// The views that are looked at: of each segment the first, and those far enough from the one
// before.
std::vector<std::size_t> SelectDenseViews(const Views& views, const DenseOptions& options);

class DepthWindow {
 public:
  // `selected`: indices of views. All arguments outlive the window.
  DepthWindow(const Views& views, const std::vector<std::size_t>& selected,
              const ViewImages& images, const DenseOptions& options);

  struct ConfirmedView {
    std::size_t view = 0;  // index of the view
    DepthGrid depth;
  };

  // Reads and matches the next selected views, as many as threads can share well. Returns those
  // whose depth is confirmed by now, in order; once is_done(), all have been returned.
  std::vector<ConfirmedView> Next();
  bool is_done() const { return confirmed_ == selected_.size(); }
  std::size_t read() const { return read_; }  // of the selected
  int64_t without_images() const { return without_images_; }

 private:
  struct WindowView {
    RigidTransform T_world_camera;
    int segment = 0;
    DepthPyramid left, right;  // the right one until the depth is refined
    DepthGrid depth;
  };

  WindowView& At(std::size_t i) { return window_[i - first_]; }
  const WindowView& At(std::size_t i) const { return window_[i - first_]; }
  void Read(std::size_t i);
  void Refine(std::size_t i);
  DepthGrid Confirm(std::size_t i) const;
  // Of the selected views around one, those of its segment.
  std::vector<std::size_t> Around(std::size_t i) const;
  std::vector<std::size_t> FindNeighbours(std::size_t i) const;

  const Views& views_;
  const std::vector<std::size_t>& selected_;
  const ViewImages& images_;
  const DenseOptions options_;
  const Camera camera_;  // the rectified left one
  std::deque<WindowView> window_;
  std::size_t first_ = 0;                               // of the window
  std::size_t read_ = 0, refined_ = 0, confirmed_ = 0;  // how many are
  int64_t without_images_ = 0;
};

// Everything dense of a map: depth of the views, their agreement, and one cloud.

struct DenseMap {
  std::vector<DensePoint> points;
  int64_t views = 0;                 // looked at
  int64_t views_without_images = 0;  // of which nothing could be had
};

// Gets the confirmed depth of views in their order, one at a time, from another thread than the
// calling one where there are several.
using DepthSink = std::function<void(std::size_t view, const DepthGrid& depth)>;

// Finds the depth of those views that are far enough apart, keeps what several agree on, and fuses
// it. The same views give the same map, to the last bit, with any number of threads; memory does
// not grow with their number but by the surface that they see. Once progress says so, the map is
// that of the views so far. Throws ConfigError when an option is not plausible.
DenseMap BuildDense(const Views& views, const ViewImages& images, const DenseOptions& options,
                    const Progress& progress = {}, const DepthSink& sink = {});

// The same for a map: sets its dense points, and its occupancy to what confirmed depth shows, and
// returns what each view saw; warnings count views that could not be used. Throws ConfigError also
// where occupancy would take too much memory.
std::vector<ViewRays> MapDensely(const Views& views, const ViewImages& images,
                                 const DenseOptions& options,
                                 const OccupancyOptions& occupancy_options,
                                 const Progress& progress, MapResult* map);

}  // namespace slcmap::mapping
