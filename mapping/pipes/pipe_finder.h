// Pipes among the lines of a map.
#pragma once

#include <vector>

#include "data/progress.h"
#include "mapping/pipes/pipe_outlines.h"

namespace slcmap {

struct PipeCandidate {
  PipeFit fit;
  std::vector<size_t> outlines;
  double from_m = 0, to_m = 0;  // along its axis from its point, where outlines show it
};

// All that two lines may be the outlines of, with the others that touch it; those found so far once
// progress says so.
std::vector<PipeCandidate> PipeCandidates(const std::vector<Outline>& outlines,
                                          const PipeOptions& options,
                                          const Progress& progress = {});

// The share of an outline's rays that touch the cylinder.
double TouchingShare(const Cylinder& cylinder, const Outline& outline, const PipeOptions& options);

}  // namespace slcmap
