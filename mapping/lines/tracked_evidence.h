// What is known of lines when they become those of a map.
#pragma once

#include <vector>

#include "mapping/line_evidence.h"
#include "mapping/lines/line_store.h"
#include "mapping/lines/view_cameras.h"

namespace slcmap {

// Of lines whose ids count from 0, and whose intervals are their pieces. A support is the straight
// line that fits the places of a piece in one image, as far as they reach.
LineEvidence EvidenceOf(const std::vector<TrackedLine>& lines, const Views& views,
                        const ViewCameras& cameras);

}  // namespace slcmap
