// Maps for CAD programs.
#pragma once

#include "export/map_writer.h"
#include "export/plan/plan_options.h"

namespace slcmap {

// Writes plan.dxf, the plans of all storeys at z = 0 (those above the lowest on layers that are
// off; where there are several, each is in plan/storey_N.dxf by itself too), sections and
// elevations as plan/NAME.dxf, upright in x and y, and map.dxf, the map in space: lines by storey,
// axis and kind, points, planes, trajectory. All in metres, in the frame of Building::T_map_world.
class DxfWriter : public MapWriter {
 public:
  DxfWriter(const PlanOptions& options, double max_jump_s)
      : options_(options), max_jump_s_(max_jump_s) {}
  std::string Format() const override { return "dxf"; }
  std::vector<std::string> Names() const override { return {"plan.dxf", "map.dxf", "plan"}; }
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;

 private:
  PlanOptions options_;
  double max_jump_s_;
};

}  // namespace slcmap
