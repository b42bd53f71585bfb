// How an adjustment of poses that were given went.
#pragma once

#include <cstdint>

namespace slcmap {

struct GivenPoseFigures {
  int64_t views = 0, pairs = 0, points = 0;
  // How far points are from where poses have them: the median over pairs of views of the length of
  // their median.
  double given_off_px = 0, off_px = 0;
  double moved_m = 0, turned_rad = 0;  // root mean square over the views
};

}  // namespace slcmap
