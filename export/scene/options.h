// The options of all formats: what those who export need, without the writers.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace slcmap::inline exporting {

// What is drawn of a map.
struct SceneOptions {
  double frustum_m = 0.2;          // length of a drawn camera
  double frustum_spacing_m = 0.5;  // keyframes nearer to the last drawn one are left out
  double max_jump_s = 0.5;   // the trajectory is not drawn across longer gaps, see TrajectoryGap_s
  double line_bar_m = 0.04;  // width of lines that are drawn as bars
  int max_vertices = 8000000;  // of all layers; some 200 bytes of memory each, with writing
  void Check() const;          // throws ConfigError
};

struct PlyOptions {
  bool ascii = false;  // as text, for scripts; up to two and a half times as large
};

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
  void Check() const;  // throws ConfigError
};

// What of a map goes into an IFC file, and what is assumed where nothing was seen.
struct IfcOptions {
  bool line_solids = false;       // lines as thin solids too: viewers often hide annotations
  double line_solid_m = 0.02;     // width of these
  double slab_m = 0.2;            // thickness of floors and ceilings, of which one face was seen
  double assumed_height_m = 2.5;  // of walls whose top was not seen
  void Check() const;             // throws ConfigError
};

struct LasOptions {
  std::string version = "1.2";  // or "1.4", which clouds of more than 2^32 - 1 points always are
  void Check() const;           // throws ConfigError
};

struct ObjOptions {
  std::string up = "z";  // or "y", as many programs of modelling and games have it
  void Check() const;    // throws ConfigError
};

struct GltfOptions {
  bool tubes =
      false;  // lines as bars too, for viewers that show only triangles or lines a pixel wide
  bool voxels = false;     // occupied voxels as cubes
  bool quantised = false;  // positions as 16 bits of each layer's extent (KHR_mesh_quantization)
};

struct TilesOptions {
  std::string page;  // the bundle of the page that shows them; "" for none
};

struct ColmapOptions {
  std::string images;  // "": none, "rectified": the model's, as its cameras would have them
  void Check() const;  // throws ConfigError
};

// Of formats that need the images of the recording.
struct RecordingOptions {
  std::string sequence;     // where it moved to; "" where the map says it is
  std::string calibration;  // that of the map, as its folder has it; "" or missing: the recording's
};

}  // namespace slcmap::exporting
