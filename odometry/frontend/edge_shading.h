// How far light that fades on one side of an edge moves the place where brightness rises most.
#pragma once

#include <array>
#include <vector>

namespace slcmap {

// Brightness across an edge at places from -kEdgeReach to kEdgeReach pixels from it, in grey
// values.
inline constexpr int kEdgeReach = 4;
using EdgeProfile = std::array<double, 2 * kEdgeReach + 1>;

// Where walls meet a ceiling or another wall, brightness does not only step by h: it also has a
// slope on either side, since light fades towards corners. Blurred by sigma, a step with the slopes
// a and b before and behind it rises most not at the edge but (b - a) sigma^2 / h behind it: by the
// same number of pixels at all depths, which turns an edge that recedes. Here that shift, from
// several profiles of one edge, in pixels; nearer to zero the less the profiles agree on it, and 0
// where they don't tell.
double ShadingShift_px(const std::vector<EdgeProfile>& profiles);

}  // namespace slcmap
