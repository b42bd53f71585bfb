// Maps as Wavefront OBJ, for CloudCompare, Blender and those who read lines from text.
#pragma once

#include <string>

#include "export/scene/map_writer.h"
#include "export/scene/options.h"

namespace slcmap::inline exporting {

// Writes map.obj, in metres, z or y up: an object (`o`) a layer of map_layers.h, lines, outlines
// and the trajectory as line elements (`l`) of two vertices each, planes as triangles (`f`); and
// map.mtl with a colour for each kind of plane, axis of lines and the trajectory.
class ObjWriter : public MapWriter {
 public:
  explicit ObjWriter(double max_jump_s, const ObjOptions& options = {})
      : max_jump_s_(max_jump_s), options_(options) {}
  std::string Format() const override { return "obj"; }
  std::vector<std::string> Names() const override { return {"map.obj", "map.mtl"}; }
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;

 private:
  double max_jump_s_;
  ObjOptions options_;
};

}  // namespace slcmap::exporting
