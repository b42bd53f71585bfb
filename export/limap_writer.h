// Lines as limap's text files.
#pragma once

#include "export/map_writer.h"

namespace slcmap {

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

}  // namespace slcmap
