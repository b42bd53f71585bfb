// Text models for COLMAP and limap, for those who go on there.
#pragma once

#include <string>

#include "export/scene/map_writer.h"
#include "export/scene/options.h"

namespace slcmap::inline exporting {

// COLMAP's text model, for those who go on there.

// Writes colmap/cameras.txt, images.txt and points3D.txt: the rectified cameras as PINHOLE, both
// images of each keyframe, and of each view between them that shows a line, with its pose and the
// points that it shows (ModelImages, ModelPoints), and the points with their tracks. A map does not
// hold colours of points: they are grey. Images as recorded have to be rectified first: on request
// they are written so under colmap/images, by their names in images.txt. A map without calibrated
// cameras has points alone.
class ColmapWriter : public MapWriter {
 public:
  explicit ColmapWriter(const ColmapOptions& options = {}, const RecordingOptions& recording = {})
      : options_(options), recording_(recording) {}
  std::string Format() const override { return "colmap"; }
  std::vector<std::string> Names() const override { return {"colmap"}; }
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;

 private:
  ColmapOptions options_;
  RecordingOptions recording_;
};

// Lines as limap's text files.

// Writes the pieces of lines twice: limap/alltracks.txt, as limap saves its tracks (their number;
// of each its id and counts, start, end, ids of images, numbers of its segments there), and
// limap/lines.txt, a row a piece with its segments, as Line3D++ has them and limap reads them.
// Images are those of COLMAP's model (ModelImages), pixels too.
class LimapWriter : public MapWriter {
 public:
  std::string Format() const override { return "limap"; }
  std::vector<std::string> Names() const override { return {"limap"}; }
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;
};

}  // namespace slcmap::exporting
