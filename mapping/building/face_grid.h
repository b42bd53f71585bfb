// What is known of a face's plane, cell by cell: hit, passed through, or unseen.
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "mapping/building/building_input.h"
#include "mapping/building/faces.h"

namespace slcmap {

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
// behind a door's leaf or a duct. What hangs from the ceiling nearly all along is no wall.
std::vector<double> WallShares(const FaceGrid& grid);

// Of the face of a wall that is at least `share` covered.
bool IsWall(const std::vector<double>& shares, double cell_m);

}  // namespace slcmap
