// What the widths in which images show two outlines say of what is between them.
#pragma once

#include <vector>

#include "mapping/pipes/outline_pairs.h"

namespace slcmap {

// How badly bodies fit the pairs, each where it fits best: squared standard deviations, of which
// large ones count less (Cauchy), in sum over two numbers a pair: the distance of the outlines from
// each other, and their middle, which is as uncertain as poses are.
struct WidthEvidence {
  int images = 0;
  double cylinder = 0;
  double edges = 0;     // two, fixed: of a strip, a board or a frame
  double bar = 0;       // of a rectangle
  double told = 0;      // what `edges` would be without noise if it is a cylinder
  double radius_m = 0;  // of the cylinder
};

// Less tells nothing.
inline constexpr double kLeastToldByWidths = 15;

// `told` alone, of pairs as a cylinder has them.
double ToldByWidths(const std::vector<OutlinePair>& pairs, double pose_sigma_m);

WidthEvidence WidthEvidenceOf(const std::vector<OutlinePair>& pairs, double radius_m,
                              double pose_sigma_m);

}  // namespace slcmap
