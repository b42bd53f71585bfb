// Whether left and right images agree from beginning to end of a recording.
#pragma once

#include "data/check/report.h"
#include "data/core/progress.h"
#include "data/source/sequence.h"

namespace slcmap::inline data {

// {first, later, late} of each piece: from this pair on, the right images are those of the pair so
// many later, and the left ones were taken so many later than their stamps say.
inline constexpr const char* kRightShiftCorrection = "right_images_shifted";
// {first, end}: the pairs that are used.
inline constexpr const char* kStretchCorrection = "pairs_used";

// Compares rows at pairs spread over a recording. Where they agree in one part and not in another,
// and the right images of other pairs move as the left ones do, those are paired anew, with stamps
// that fit the gyroscope; where a turn of a camera explains it, the other part goes on with the
// left images only, or is left out if those do not fit the gyroscope. Both are a finding and a
// correction. Nothing is done, nor said, where neither explains it.
void MendIntervals(Sequence* sequence, const Progress& progress, CheckReport* report);

// Without the images that have lost their right one.
Sequence SelectPairs(Sequence sequence);

}  // namespace slcmap::data
