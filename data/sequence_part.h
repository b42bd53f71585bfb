// A part of a recording, by time.
#pragma once

#include "data/sequence.h"

namespace slcmap {

// Seconds from the first image.
struct SequencePart {
  double from_s = 0;
  double duration_s = 0;  // 0: to the end
  // Throws ConfigError, naming --from or --duration, for a time that cannot be.
  void Check() const;
};

// Drops the images of other times, and the IMU samples further than a second from those that stay.
// Throws ConfigError when no image is left.
void KeepPart(const SequencePart& part, Sequence* sequence);

}  // namespace slcmap
