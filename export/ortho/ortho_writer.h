// Orthophotos of the walls, floors and ceilings of a map, out of the images of its recording.
#pragma once

#include <memory>
#include <vector>

#include "export/scene/map_writer.h"
#include "export/scene/options.h"
#include "export/scene/plane_canvas.h"

namespace slcmap::inline exporting {

// Writes ortho/NAME.png for each face that some keyframe's image saw (ListFaces), with alpha 0
// where none did, ortho/NAME.pgw, its world file, and ortho/orthophotos.json, which says where they
// lie in the frame of exports. The same images, as fine as textures should be, are added to
// `textures`, where that is given. Throws DataError where the recording is missing, or has none of
// the images that were chosen.
class OrthoWriter : public MapWriter {
 public:
  explicit OrthoWriter(const RecordingOptions& recording = {},
                       std::shared_ptr<std::vector<FaceTexture>> textures = nullptr)
      : recording_(recording), textures_(std::move(textures)) {}
  std::string Format() const override { return "ortho"; }
  bool IsWrittenByDefault() const override { return false; }
  std::vector<std::string> Names() const override { return {"ortho"}; }
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;

 private:
  RecordingOptions recording_;
  std::shared_ptr<std::vector<FaceTexture>> textures_;
};

}  // namespace slcmap::exporting
