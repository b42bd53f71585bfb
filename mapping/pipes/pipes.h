// The pipes of a map, which its lines are outlines of.
#pragma once

#include <vector>

#include "data/core/progress.h"
#include "mapping/map/map.h"
#include "mapping/pipes/outline_pairs.h"
#include "mapping/pipes/pipe_fit.h"

namespace slcmap::inline mapping {

struct FoundPipes {
  std::vector<MapPipe> pipes;
  std::vector<int64_t> line_ids;  // of lines that they explain: no edges of the building, sorted
};

// The same map and images give the same pipes, whatever the number of threads. Without images, thin
// ones and those that only their widths tell are not found; once progress says so, none are.
FoundPipes FindPipes(const MapResult& map, const PipeOptions& options,
                     const PipeImages* images = nullptr, const Progress& progress = {});

// Finds the pipes of a map with lines and a dense cloud; the lines that they explain, with what is
// known of these, leave the map.
void AddPipes(const PipeOptions& options, const PipeImages* images, const Progress& progress,
              MapResult* map);

}  // namespace slcmap::mapping
