// What of a map goes into an IFC file, and what is assumed where nothing was seen.
#pragma once

namespace slcmap {

struct IfcOptions {
  bool line_solids = false;       // lines as thin solids too: viewers often hide annotations
  double line_solid_m = 0.02;     // width of these
  double slab_m = 0.2;            // thickness of floors and ceilings, of which one face was seen
  double assumed_height_m = 2.5;  // of walls whose top was not seen
  void Check() const;             // throws ConfigError
};

}  // namespace slcmap
