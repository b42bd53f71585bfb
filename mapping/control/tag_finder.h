// AprilTags and ArUco tags in the images of a recording.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "data/core/progress.h"
#include "data/source/sequence_source.h"
#include "mapping/control/control_points.h"

namespace slcmap::inline mapping {

// The middles of those tags that are asked for, in both images of the pairs at the stamps, which
// the map has later by `stamps_moved_ns`; of names that do not say their family that which most of
// the images show. Names of no tags are passed over. Throws StoppedError when progress says so.
std::vector<Sighting> FindTags(const SequenceSource& recording,
                               const std::vector<int64_t>& stamps_ns, int64_t stamps_moved_ns,
                               const std::vector<std::string>& names,
                               const Progress& progress = {});

// The index of the recording's pair at a stamp that may be rounded to a thousandth of a second;
// nothing where there is none.
std::optional<size_t> FindPair(const SequenceSource& recording, int64_t stamp_ns);

}  // namespace slcmap::mapping
