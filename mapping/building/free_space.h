// Where rays went through, as a grid of the plan of one storey, and what is known of a face's
// plane, cell by cell: hit, passed through, or unseen.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "data/core/polygon.h"
#include "data/core/progress.h"
#include "mapping/building/faces.h"
#include "mapping/map/building.h"

namespace slcmap::inline mapping {

class FreeSpace {
 public:
  // Covers the box, in cells of that side. Metres, in world.
  FreeSpace(const Eigen::AlignedBox2d& box, double cell_m);

  // Marks the way between two points.
  void AddWay(const Eigen::Vector2d& from, const Eigen::Vector2d& to);

  // Those of another space of the same box and cells.
  void AddWaysFrom(const FreeSpace& other);

  bool IsFree(const Eigen::Vector2d& point) const;

  // The part of a polygon that is free, 0 to 1; of one that is smaller than a cell, whether its
  // first corner is.
  double ComputeShareFree(const Polygon& polygon) const;

  // Around the middles of all cells that are free, along turned axes; empty where nothing is.
  Eigen::AlignedBox2d FreeBox(const Eigen::Rotation2Dd& R_box_world) const;

 private:
  int64_t FindIndex(const Eigen::Vector2d& point) const;  // -1: outside

  Eigen::AlignedBox2d box_;
  double cell_m_;
  int64_t columns_, rows_;
  std::vector<uint8_t> ways_;  // through a cell, at most 255
};

// In the plan.
struct FreeWay {
  Eigen::Vector2d from, to;
};

// Where the ray from a camera to a point that is known up to sigma_m tells, between a storey's
// floor and top, that nothing stands: without what is near these, and without its end, of a cell at
// least.
std::optional<FreeWay> FindFreeWay(const Eigen::Vector3d& p_world_camera,
                                   const Eigen::Vector3d& end, double sigma_m, double floor_m,
                                   double top_m, double cell_m);

// The rays of all views, or every so manieth if there are as many as max_rays.
class FreeSpaceRays {
 public:
  // `seen` must outlive it.
  explicit FreeSpaceRays(const std::vector<ViewRays>& seen, size_t max_rays = 2000000);

  size_t views() const { return seen_.size(); }

  // Calls use(p_world_camera, end, sigma_m) for the rays of a view.
  template <typename Use>
  void ForEachIn(size_t view, Use use) const {
    const ViewRays& of_view = seen_[view];
    for (size_t i = first_[view]; i < of_view.p_world.size(); i += step_) {
      use(of_view.p_world_camera, Eigen::Vector3d(of_view.p_world[i].cast<double>()),
          static_cast<double>(of_view.sigma_m[i]));
    }
  }

  // Calls work(begin, end) for some views at a time. Throws StoppedError once progress says so.
  template <typename Work>
  void ForSomeViews(const Progress& progress, Work work) const {
    constexpr size_t kAtOnce = 8;
    for (size_t begin = 0; begin < views(); begin += kAtOnce) {
      progress.ReportOrStop(static_cast<double>(begin) / static_cast<double>(views()));
      work(begin, std::min(views(), begin + kAtOnce));
    }
  }

 private:
  const std::vector<ViewRays>& seen_;
  size_t step_ = 1;
  std::vector<size_t> first_;  // by view, of those that count
};

// Rows go up from low_m, columns along the face from from_m, in cells of cell_m.
struct FaceGrid {
  double from_m = 0, low_m = 0, cell_m = 0.05;
  cv::Mat1i hits;     // ends of rays at the plane: something is there, before or behind it
  cv::Mat1i passes;   // rays that went through
  cv::Mat1i support;  // measured places on the plane itself
  cv::Mat1i others;   // and on what is a little before or behind it, alike,
  cv::Mat1i behind;   // and on that which is behind it

  FaceGrid(const Face& face, double low_m, double high_m, double cell_m);

  int columns() const { return hits.cols; }
  int rows() const { return hits.rows; }
  bool IsHit(int row, int column) const;
  // Seen through by at least two rays, and by more than what says that something is there.
  bool IsPassed(int row, int column) const;

  void AddHit(double along_m, double z_m) { Count(along_m, z_m, &hits); }
  void AddPass(double along_m, double z_m) { Count(along_m, z_m, &passes); }
  void AddSupport(double along_m, double z_m) { CountOnFace(along_m, z_m, &support); }
  void AddOther(double along_m, double z_m, bool is_behind) {
    CountOnFace(along_m, z_m, &others);
    if (is_behind) CountOnFace(along_m, z_m, &behind);
  }

 private:
  void Count(double along_m, double z_m, cv::Mat1i* counts) const;
  void CountOnFace(double along_m, double z_m, cv::Mat1i* counts) const;  // and just over its ends
};

// Adds a ray from a camera to what it saw: a pass where it ends more than behind_m and 3 of its
// standard deviations beyond the plane, on either side. Only the ways beyond count as passes, and
// only an end nearer to the plane than that as a hit.
void AddRay(const Face& face, const Eigen::Vector3d& camera, const Eigen::Vector3d& end,
            double sigma_m, double behind_m, FaceGrid* grid);

// What stands in the columns of a grid: the share of each, 0 to 1, that is sure to be a wall. One
// that reaches the top of the storey is; one whose top was not seen counts half; none is one over
// which rays pass, as over a cupboard, or behind or before which something else reaches the top, as
// behind a door's leaf or a duct.
struct WallCover {
  std::vector<double> shares;  // between covered columns also where nobody saw anything
  std::vector<bool> is_solid;  // measured at the top, and hardly passed anywhere
  double measured_m = 0;       // the covered length, without what nobody saw
};

WallCover FindCover(const FaceGrid& grid);

// Of the face of a wall that is at least `share` covered.
bool IsWall(const std::vector<double>& shares, double cell_m);

}  // namespace slcmap::mapping
