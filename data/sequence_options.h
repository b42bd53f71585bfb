// How a recording is opened: of a run and a map too, whose images are opened again.
#pragma once

#include <string>
#include <vector>

#include "data/calibration.h"

namespace slcmap {

struct SequenceOptions {
  Mirrored mirrored = Mirrored::kRefused;  // rotations of the calibration
  std::string calibration;                 // file or folder; "" takes the sequence's own
  double max_stereo_offset_s = 0.003;      // between the stamps of a pair, once those are made up
  double right_offset_s = 0;               // right stamps are late by this
  std::vector<std::string> masks;          // image files, one a camera (data/mask.h)
  std::vector<int> cameras;                // of a chain of them; empty: the best stereo pair
  bool needs_imu = true;  // false: a recording without imu0 will do, and its samples stay unread
};

}  // namespace slcmap
