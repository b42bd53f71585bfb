// What images say of the surfaces at the two sides of a line: that they are one plane, which the
// line is a mark on, or that one of them lies behind it.
#pragma once

#include <vector>

#include "data/core/progress.h"
#include "mapping/lines/line_samples.h"
#include "mapping/lines/line_store.h"
#include "mapping/views/view.h"

namespace slcmap::inline mapping {

// Compares bands beside pieces of each line in reference views with what other views show, if the
// band lies on a half-plane through the line, or on a plane behind it. The log-likelihood ratios
// are marginalised over the planes, and summed in TrackedLine::sides. Once progress says so, later
// views are left out.
void CompareSides(const Views& views, const ViewImages& images, const VisibilityDepths& depths,
                  std::vector<TrackedLine>* lines, const Progress& progress);

}  // namespace slcmap::mapping
