// How much of what the last keyframe saw a later image still shows.
#pragma once

#include <cstdint>
#include <optional>
#include <unordered_set>

#include "odometry/window/window_state.h"

namespace slcmap {

// The points of the last keyframe, and those of them that a later frame has.
struct KeptPoints {
  int all = 0, kept = 0;
  // Shown by something else than the last keyframe's left image. What was detected in noise is soon
  // gone, and must not look as if the view had changed.
  int proven = 0, proven_kept = 0;

  // Those that the later frame proves count too.
  int True() const { return proven + kept - proven_kept; }
  bool AreFewerThan(double share) const;
};

// A point is proven by a keyframe before the last one, or by the last one's right image together
// with the image that came next, which had the points `followed` (none while it is the frame):
// noise is found alike in both images of a pair often enough, but not in the next one as well.
KeptPoints CountKept(const WindowState& window, const FrameState& frame,
                     const std::optional<std::unordered_set<int64_t>>& followed);

}  // namespace slcmap
