// Which parts of a building's true edges the cameras saw well, from true poses.
#pragma once

#include <vector>

#include "apps/evaluation/triangle_tree.h"
#include "apps/evaluation/true_edges.h"
#include "data/progress.h"
#include "data/trajectory.h"
#include "data/types.h"

namespace slcmap {

struct ClearSightOptions {
  double min_length_m = 0.3;  // of an edge
  double max_range_m = 8;     // from which a frame shows a place of it
  int min_frames = 20;        // that do
  double interval_s = 0.05;   // between frames, however many images a second there are
  double sample_m = 0.04;     // along an edge
  double margin_m = 0.002;    // a surface this near in front of a place does not hide it
  void Check() const;         // throws ConfigError
};

// The parts of the edges that the left camera saw often enough from near enough, not hidden by the
// surfaces. Throws StoppedError when progress says so.
std::vector<PlySegment> ClearlySeen(const TrueEdges& edges, const TriangleTree& surfaces,
                                    const Trajectory& truth, const Rig& rig,
                                    const ClearSightOptions& options,
                                    const Progress& progress = {});

}  // namespace slcmap
