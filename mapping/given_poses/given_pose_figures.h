// How an adjustment of poses that were given went.
#pragma once

#include <cstdint>

namespace slcmap {

struct GivenPoseFigures {
  int64_t views = 0, pairs = 0, points = 0;
  // How far points are from where poses have them: the median over pairs of views of the length of
  // their median.
  double given_off_px = 0, off_px = 0;
  // What all poses shared: how far the body that was tracked is turned and shifted against the
  // rig's IMU, and how far its clock is behind the images'.
  double body_turned_rad = 0, body_shifted_m = 0, clock_s = 0;
  double moved_m = 0, turned_rad = 0;  // of each on top of that: root mean square over the views
};

}  // namespace slcmap
