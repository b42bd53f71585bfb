// The options of all formats: what those who export need, without the writers.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace slcmap::inline exporting {

// Of drawn plans.
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

struct GridOptions {
  // Over the floor: what is below a robot's wheels or above its head is in nobody's way.
  double low_m = 0.2, high_m = 1.8;
};

struct GltfOptions {
  bool tubes =
      false;  // lines as bars too, for viewers that show only triangles or lines a pixel wide
  bool voxels = false;     // occupied voxels as cubes
  bool quantised = false;  // positions as 16 bits of each layer's extent (KHR_mesh_quantization)
};

// Of formats that need the images of the recording.
struct RecordingOptions {
  std::string sequence;     // where it moved to; "" where the map says it is
  std::string calibration;  // that of the map, as its folder has it; "" or missing: the recording's
};

}  // namespace slcmap::exporting
