// Maps as Wavefront OBJ, for CloudCompare, Blender and those who read lines from text.
#pragma once

#include "export/map_writer.h"

namespace slcmap {

// Writes map.obj, in metres in the world frame: an object (`o`) a layer of map_layers.h, lines,
// outlines and the trajectory as line elements (`l`), planes as triangles (`f`).
class ObjWriter : public MapWriter {
 public:
  explicit ObjWriter(double max_jump_s) : max_jump_s_(max_jump_s) {}
  std::string Format() const override { return "obj"; }
  std::vector<std::string> Names() const override { return {"map.obj"}; }
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;

 private:
  double max_jump_s_;
};

}  // namespace slcmap
