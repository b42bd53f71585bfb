// The pipes of a map, which its lines are outlines of.
#pragma once

#include <cstdint>
#include <vector>

#include "data/core/progress.h"
#include "data/io/yaml.h"
#include "mapping/map/map.h"

namespace slcmap::inline mapping {

struct PipeOptions {
  bool find = true;
  double min_radius_m = 0.015, max_radius_m = 0.32;
  double min_length_m = 0.75;
  void Check() const;  // throws ConfigError
  void Read(YamlSection section);
};

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
