// How wide images show a pipe.
//
// Where a view shows both outlines of a pipe, their distance from each other hangs on the view's
// pose by far less than the place of each does: it is known to a fraction of a pixel, and tells a
// cylinder, which is as wide from all sides, from two edges and from a bar.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/core/math.h"
#include "data/core/progress.h"
#include "mapping/pipes/pipe_fit.h"
#include "mapping/views/view.h"

namespace slcmap::inline mapping {

// What one image has of both outlines, as seen along an axis (AcrossAxis): places x with
// normals[i] . x = offsets_m[i] are on the plane through the camera and an outline. The normals
// point from the first outline to the second.
struct OutlinePair {
  Eigen::Vector2d normals[2] = {Eigen::Vector2d::UnitX(), Eigen::Vector2d::UnitX()};
  double offsets_m[2] = {0, 0};
  double sigma_m = 0;  // of each, apart from what the image's pose is off
};

// A cylinder that may be there, between two places along its axis.
struct PipePlace {
  Cylinder cylinder;
  Interval interval;
  int segment = 0;  // of the run: only views of the same are asked
};

// Images that show a pipe thinner than that tell nothing: blur moves outlines by too much of it.
inline constexpr double kLeastPipeWidth_px = 4;

// The images that pipes are looked at in.
struct PipeImages {
  const Views& views;
  const ViewImages& images;
};

// What cameras that have a place in their images would show of it, if nothing hid it and it were as
// clear as an outline can be.
std::vector<OutlinePair> ExpectedPairs(const PipePlace& place, const Views& views,
                                       const ViewCameras& cameras);

// Of each place the pairs that the images of some views show, by view and camera, left first.
// Images are read once. Once progress says so, the pairs are those that were found so far.
std::vector<std::vector<OutlinePair>> FindOutlinePairs(const std::vector<PipePlace>& places,
                                                       const PipeImages& images,
                                                       const std::vector<size_t>& views,
                                                       const Progress& progress = {});

// How badly bodies fit the pairs, each where it fits best: squared standard deviations, of which
// large ones count less (Cauchy), in sum over two numbers a pair: the distance of the outlines from
// each other, and their middle, which is as uncertain as poses are.
struct WidthEvidence {
  int images = 0;
  double cylinder = 0;
  double edges = 0;     // two, fixed: of a strip, a board or a frame
  double bar = 0;       // of a rectangle
  double told = 0;      // what `edges` would be without noise if it is a cylinder
  double radius_m = 0;  // of the cylinder
};

// Less tells nothing.
inline constexpr double kLeastEdgeMisfit = 15;

// `told` alone, of pairs as a cylinder has them.
double ExpectEdgeMisfit(const std::vector<OutlinePair>& pairs, double pose_sigma_m);

WidthEvidence CollectWidthEvidence(const std::vector<OutlinePair>& pairs, double radius_m,
                                   double pose_sigma_m);

// How wide images show what may be pipes.

// By place; no images of those where they cannot tell a pipe from two edges, or where a part of
// them speaks clearly against one, and of all once progress says so.
std::vector<WidthEvidence> MeasureWidths(const std::vector<PipePlace>& places,
                                         const PipeImages& images, double pose_sigma_m,
                                         const Progress& progress = {});

}  // namespace slcmap::mapping
