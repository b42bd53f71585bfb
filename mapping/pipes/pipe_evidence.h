// What speaks for a pipe, what against it, and whether it is enough.
#pragma once

#include <vector>

#include "mapping/map/map.h"
#include "mapping/map/point_index.h"
#include "mapping/pipes/outline_pairs.h"
#include "mapping/pipes/pipe_fit.h"

namespace slcmap::inline mapping {

// How far rays are from what they should touch, in standard deviations.
struct Misfit {
  double squared = 0;  // the sum, 9 at most of each; the two rays to the ends of an outline are one
  double median = 0;
};

// The rays to some lines, taken for the outlines of one cylinder.
struct RayEvidence {
  Misfit round;      // from the cylinder
  Misfit own;        // from a fixed edge for each line, where it fits best
  Misfit straight;   // from one fixed edge on each side of the cylinder, where it fits best
  Misfit told;       // what `straight` would be without noise if it is a cylinder
  int outlines = 0;  // one of each line in each image
  int images = 0;
  int both_images = 0;  // that show an outline on each side
  // Images show an edge that stays between the outlines, as of a post that is seen corner on: what
  // other lines say, not these.
  bool has_ridge = false;
};

using RaysOfLines = std::vector<const std::vector<TangentRay>*>;

RayEvidence CollectRayEvidence(const Cylinder& cylinder, const RaysOfLines& lines);

// What the dense cloud has about a cylinder, as its views see it. Heights are those before the
// plane through the axis that faces the views, in radii.
struct SurfaceEvidence {
  int points = 0;  // near the middle between the outlines, and not far behind them
  // Of these: 0.9 of a pipe, 0 of what is flat.
  double height = 0;   // the median
  double highest = 0;  // 85 % are below
  double off = 0;      // the median distance from the cylinder, in radii
  // Beside the outlines, on the side where it is higher: the median. A pipe stands free, or before
  // a wall; what a wall goes on beside is a trim or the frame of a door. Low where nothing is
  // known.
  double beside = -10;
  double length_m = 0;  // between the two places
};

// A dense cloud, to be asked for at many cylinders. It must outlive this.
class CloudAboutPipes {
 public:
  explicit CloudAboutPipes(const std::vector<DensePoint>& cloud);

  // Between two places along the axis, from its point.
  SurfaceEvidence Of(const Cylinder& cylinder, double from_m, double to_m,
                     const RaysOfLines& lines) const;

 private:
  const std::vector<DensePoint>& cloud_;
  PointTree index_;
};

// Whether enough of the images show outlines on both sides, as of any pipe.
bool ShowsBothSides(const RayEvidence& rays);

// For thinner ones the cloud is too coarse.
inline constexpr double kLeastRadiusOfCloud_m = 0.035;

// Whether the cloud says so.
bool IsFlat(const Cylinder& cylinder, const SurfaceEvidence& surface);

// Whether lines are the outlines of a pipe, and of nothing else that is straight: the images tell
// it from fixed edges and the cloud does not speak against it, or the cloud is as round as it, or
// bulges between them, or it stands free.
bool IsPipe(const Cylinder& cylinder, const RayEvidence& rays, const SurfaceEvidence& surface,
            const PipeOptions& options);

// Whether images show it as wide as a pipe is and nothing else, and the cloud does not say that it
// is flat.
bool HasPipeWidth(const Cylinder& cylinder, const WidthEvidence& widths,
                  const SurfaceEvidence& surface);

}  // namespace slcmap::mapping
