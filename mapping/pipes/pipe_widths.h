// How wide images show what may be pipes.
#pragma once

#include <vector>

#include "mapping/pipes/outline_pairs.h"
#include "mapping/pipes/width_evidence.h"

namespace slcmap {

// By place; no images of those where they cannot tell a pipe from two edges, or where a part of
// them speaks clearly against one, and of all once progress says so.
std::vector<WidthEvidence> WidthsOf(const std::vector<PipePlace>& places, const PipeImages& images,
                                    double pose_sigma_m, const Progress& progress = {});

}  // namespace slcmap
