// How well the poses of views agree with what their images show.
#pragma once

#include <optional>

#include "data/progress.h"
#include "mapping/views/view.h"

namespace slcmap {

struct PoseAgreement {
  // What the poses of two views let a point be off across its epipolar line, in pixels: the median
  // over pairs of views of 1.48 times the median over their points. None where too little was
  // found.
  std::optional<double> across_px;
  int pairs = 0;
  // Of the points that were looked for, the share that was found; few where poses are not of the
  // recording. 1 where images show nothing to look for.
  double found = 1;
};

// Looks for corners of the left images that their right ones show, too, at the depth that the pair
// has them, where the poses have them in a later view's left image, up to 12 pixels from there:
// what the right image does not show is noise. Up to 40 pairs of views from all over the recording
// are looked at. Nothing where no view overlaps with a later one, and where progress ended it.
std::optional<PoseAgreement> MeasurePoseAgreement(const Views& views, const ViewImages& images,
                                                  const Progress& progress = {});

// Counts, as a warning of a map, that poses and images do not fit.
inline constexpr const char* kPosesDisagree = "poses_disagree";

}  // namespace slcmap
