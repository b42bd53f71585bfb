// How far from straight something is along its length, however densely it was sampled.
#pragma once

#include <optional>
#include <vector>

namespace slcmap::inline evaluation {

// A place of a wall or an edge beside the plane or line fitted to it.
struct StraightSample {
  double along_m = 0, up_m = 0;
  double off_m = 0;
  double weight = 1;  // the share of the wall or edge that it stands for
};

// Of all places that a straightedge of a length can be laid at.
struct LaidStraightedge {
  double length_m = 0;
  double laid_m = 0;  // length of the wall or edge that it was laid on
  double rms_m = 0;   // of samples from the plane or line that fits best beneath it
  double gap_m = 0;   // the largest beneath it, without what noise alone makes
};

inline constexpr double kMapStraightedges_m[] = {1, 4, 10};

// DIN 18202 (finished walls), by interpolation between the lengths that it lists: the gap under a
// straightedge of a length (3, 5, 10, 20, 25 mm at 0.1, 1, 4, 10, 15 m). A real wall may bend by as
// much: less cannot be blamed on a map.
double AllowedGap_m(double length_m);

// By length, those that can be laid. Samples in any order; noise_m: standard deviation of one.
std::vector<LaidStraightedge> LayStraightedges(std::vector<StraightSample> samples, double noise_m);

// The standard deviation of samples from a curve through their means, as the median has it.
double RobustNoise_m(const std::vector<StraightSample>& samples, double step_m);

// The largest gap under a straightedge as long as the whole; 0 where it is too short.
double WholeGap_m(std::vector<StraightSample> samples, double noise_m);

}  // namespace slcmap::evaluation
