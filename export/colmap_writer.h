// COLMAP's text model, for those who go on there.
#pragma once

#include "export/map_writer.h"

namespace slcmap {

// Writes colmap/cameras.txt, images.txt and points3D.txt: the rectified cameras as PINHOLE, both
// images of each keyframe, and of each view between them that shows a line, with its pose, and the
// points. A map does not hold which image saw which point, colours of points or errors of their
// projections: images have no points, points no tracks, an error of -1 and grey. Images are named
// as recordings in EuRoC's layout have them, cam0/data/STAMP.png; those have to be rectified first.
// A map without calibrated cameras has points alone.
class ColmapWriter : public MapWriter {
 public:
  std::string Format() const override { return "colmap"; }
  std::vector<std::string> Names() const override { return {"colmap"}; }
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;
};

}  // namespace slcmap
