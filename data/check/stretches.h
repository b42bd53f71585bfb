// Whether left and right images agree from beginning to end of a recording.
#pragma once

#include "data/check/report.h"
#include "data/progress.h"
#include "data/sequence.h"

namespace slcmap {

// {first, later}: from this pair on (or up to it, where that is less than 0: up to its negative),
// the right images are those of the pair so many later.
inline constexpr const char* kRightShiftCorrection = "right_images_shifted";
// {first, end}: the pairs that are used.
inline constexpr const char* kStretchCorrection = "pairs_used";

// Compares rows at pairs spread over a recording. Where they agree in one part and not in the
// other, and right images of other pairs mend that, those are paired anew; where a turn of the
// right camera does, the other part is left out. Both are a finding and a correction. Nothing is
// done, nor said, where neither explains it. The first is no more than the rows show: images that
// turn about the vertical move along them.
void MendStretches(Sequence* sequence, const Progress& progress, CheckReport* report);

}  // namespace slcmap
