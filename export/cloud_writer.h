// Clouds and occupancy in the formats of PCL and OctoMap.
#pragma once

#include "export/map_writer.h"
#include "export/ply_options.h"

namespace slcmap {

// Writes points.pcd, dense.pcd, dense.ply and occupancy.bt, as a map folder holds them, but
// dense.ply in the form that is asked for.
class CloudWriter : public MapWriter {
 public:
  explicit CloudWriter(const PlyOptions& options = {}) : options_(options) {}
  std::string Format() const override { return "cloud"; }
  std::vector<std::string> Names() const override;
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;

 private:
  const PlyOptions options_;
};

}  // namespace slcmap
