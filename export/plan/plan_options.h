// Options of drawn plans.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace slcmap::inline exporting {

struct PlanOptions {
  // 1 : scale, for all storeys; 0: 1:50 where a sheet of A2 holds each storey, else 1:100, and
  // smaller only where A0 does not.
  int scale = 0;
  bool wall_sigma = false;   // write the standard deviation of its face beside each wall
  bool millimetres = false;  // lengths are written in whole millimetres, not in metres
  // Of the title block; "" for the recording's name, the day of its first image, and one made of
  // the map's id. A storey's number is added to that of the drawing.
  std::string project, date, number;
  // Where the compass' north is: degrees clockwise from up on the sheet. A map does not know it.
  std::optional<double> north_deg;
  // Where the building is cut, each as ParseSection takes it; what is drawn of it from the side:
  // "sides" from outside, "rooms" from within.
  std::vector<std::string> sections, elevations;
  void Check() const;  // throws ConfigError
};

}  // namespace slcmap::exporting
