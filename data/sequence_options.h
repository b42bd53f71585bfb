// How a recording is opened: of a run and a map too, whose images are opened again.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "data/calibration.h"

namespace slcmap {

// Images that were paired otherwise than their stamps have it, as a check mended them.
struct PairPiece {
  int64_t from_ns = 0, to_ns = 0;  // of the first and the last left image, as PairImages has them
  int later = 0;                   // the right images are those of the pairs so many later
  int late = 0;                    // the left ones have the stamps of the pairs so many later
  bool has_right = true;           // false: the right images are not used
};

struct SequenceOptions {
  Mirrored mirrored = Mirrored::kRefused;  // rotations of the calibration
  std::string calibration;                 // file or folder; "" takes the sequence's own
  double max_stereo_offset_s = 0.003;      // between the stamps of a pair, once those are made up
  double right_offset_s = 0;               // right stamps are late by this
  std::vector<std::string> masks;          // image files, one a camera (data/mask.h)
  std::vector<int> cameras;                // of a chain of them; empty: the best stereo pair
  bool needs_imu = true;  // false: a recording without imu0 will do, and its samples stay unread
  std::vector<PairPiece> pieces = {};  // of the images that are used; none: all, as paired
};

}  // namespace slcmap
