// What of a map goes into an IFC file, and what is assumed where nothing was seen.
#pragma once

#include "export/scene/map_writer.h"
#include "export/scene/options.h"

namespace slcmap::inline exporting {

// IFC4, for programs of building information modelling.

// Writes map.ifc: project, site, building, storeys; walls with openings and doors, slabs, spaces,
// pipes, and lines as annotations. Metres, in the map's world; without a compass there is no true
// north. What cannot be a solid is left out, with a warning that counts it.
class IfcWriter : public MapWriter {
 public:
  explicit IfcWriter(const IfcOptions& options) : options_(options) {}
  std::string Format() const override { return "ifc"; }
  std::vector<std::string> Names() const override { return {"map.ifc"}; }

  // Throws also DataError for a map with numbers that are not finite, and ConfigError for options
  // out of their range.
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;

 private:
  IfcOptions options_;
};

}  // namespace slcmap::exporting
