// Clouds and occupancy in the formats of PCL and OctoMap.
#pragma once

#include "export/map_writer.h"

namespace slcmap {

// Writes points.pcd, dense.pcd, dense.ply and occupancy.bt, as a map folder holds them.
class CloudWriter : public MapWriter {
 public:
  std::string Format() const override { return "cloud"; }
  std::vector<std::string> Names() const override;
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;
};

}  // namespace slcmap
