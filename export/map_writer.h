// The formats that a map can be written in.
#pragma once

#include <string>
#include <vector>

#include "data/progress.h"
#include "mapping/map.h"

namespace slcmap {

// Writes maps in one format.
class MapWriter {
 public:
  virtual ~MapWriter() = default;

  virtual std::string Format() const = 0;  // as named on the command line, such as "dxf"

  // All that it may write into a folder: names of files, and of folders of its own.
  virtual std::vector<std::string> Names() const = 0;

  // Writes files into an existing folder and returns their paths. Throws OutputError, and
  // StoppedError when progress says so.
  virtual std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                         const Progress& progress) const = 0;
};

}  // namespace slcmap
