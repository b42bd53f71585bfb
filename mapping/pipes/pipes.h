// The pipes of a map, which its lines are outlines of.
#pragma once

#include <cstdint>
#include <vector>

#include "data/core/progress.h"
#include "mapping/map/map.h"
#include "mapping/pipes/options.h"

namespace slcmap::inline mapping {

struct FoundPipes {
  std::vector<MapPipe> pipes;
  std::vector<int64_t> line_ids;  // of lines that they explain: no edges of the building, sorted
};

// The same map gives the same pipes, whatever the number of threads; once progress says so, none.
FoundPipes FindPipes(const MapResult& map, const PipeOptions& options,
                     const Progress& progress = {});

// Finds the pipes of a map with lines and a dense cloud; the lines that they explain, with what is
// known of these, leave the map.
void AddPipes(const PipeOptions& options, const Progress& progress, MapResult* map);

}  // namespace slcmap::mapping
