// Grids of what is occupied, for robots that find their way in a plane.
#pragma once

#include "export/scene/map_writer.h"
#include "export/scene/options.h"

namespace slcmap::inline exporting {

// Writes grid/storey_N.pgm and storey_N.yaml for each storey, as ROS' map_server reads them: a cell
// is occupied (0) where a voxel of the occupancy map is within a band of heights over the storey's
// floor, else free (254) where one is, else unknown (205). Row 0 is at the top, the largest y. Of a
// map without storeys one, `grid/no_storey`, over its lowest voxel. Throws DataError for a map that
// is too large.
class GridWriter : public MapWriter {
 public:
  explicit GridWriter(const GridOptions& options = {}) : options_(options) {}
  std::string Format() const override { return "grid"; }
  std::vector<std::string> Names() const override { return {"grid"}; }
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;

 private:
  GridOptions options_;
};

}  // namespace slcmap::exporting
