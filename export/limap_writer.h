// Lines as limap's text files.
#pragma once

#include "export/map_writer.h"

namespace slcmap {

// Writes the lines twice: limap/alltracks.txt, as limap saves its tracks (their number; of each its
// id and counts, start, end, ids of images, ids of lines), and limap/lines.txt, a row a line, as
// Line3D++ has them and limap reads them. A map does not hold which images saw a line: tracks have
// no supports.
class LimapWriter : public MapWriter {
 public:
  std::string Format() const override { return "limap"; }
  std::vector<std::string> Names() const override { return {"limap"}; }
  std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                 const Progress& progress) const override;
};

}  // namespace slcmap
