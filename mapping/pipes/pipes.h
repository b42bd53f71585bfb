// The pipes of a map, which its lines are outlines of.
#pragma once

#include <vector>

#include "mapping/pipes/pipe_evidence.h"
#include "mapping/pipes/pipe_finder.h"

namespace slcmap {

// Whether lines are the outlines of a pipe, and of nothing else that is straight: the images tell
// it from fixed edges and the cloud does not speak against it, or the cloud is as round as it, or
// bulges between them, or it stands free.
bool IsPipe(const Cylinder& cylinder, const RayEvidence& rays, const SurfaceEvidence& surface,
            const PipeOptions& options);

struct FoundPipes {
  std::vector<MapPipe> pipes;
  std::vector<int64_t> line_ids;  // of lines that they explain: no edges of the building, sorted
};

// The same map gives the same pipes, whatever the number of threads.
FoundPipes FindPipes(const MapResult& map, const PipeOptions& options);

// Finds the pipes of a map with lines and a dense cloud; the lines that they explain, with what is
// known of these, leave the map.
void AddPipes(const PipeOptions& options, MapResult* map);

}  // namespace slcmap
