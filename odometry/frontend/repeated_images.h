// Tells images that a hanging camera has delivered again.
#pragma once

#include "data/types.h"

namespace slcmap {

class RepeatedImages {
 public:
  struct Repeats {
    bool left = false, right = false;
  };

  // Whether each image of a pair is, byte by byte, that of the pair before. An image of one grey
  // value is none: darkness looks the same however the rig moves. Takes copies.
  Repeats Compare(const StereoImage& image);

 private:
  StereoImage last_;
};

}  // namespace slcmap
