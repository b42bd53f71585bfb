// What goes into a COLMAP model besides the map.
#pragma once

#include <string>

namespace slcmap {

struct ColmapOptions {
  std::string images;       // "": none, "rectified": the model's, as its cameras would have them
  std::string sequence;     // where the recording moved to; "" where the map says it is
  std::string calibration;  // that of the map, as its folder has it; "" or missing: the recording's
  void Check() const;       // throws ConfigError
};

}  // namespace slcmap
