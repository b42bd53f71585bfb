// The formats that a map can be written in, and what all their files say of far maps.
#pragma once

#include <spdlog/fmt/fmt.h>

#include <string>
#include <vector>

#include "data/core/progress.h"
#include "mapping/map/map.h"

namespace slcmap::inline exporting {

// Writes maps in one format.
class MapWriter {
 public:
  virtual ~MapWriter() = default;

  virtual std::string Format() const = 0;  // as named on the command line, such as "dxf"

  // False: only where it is asked for by its name, as it needs more than the map.
  virtual bool IsWrittenByDefault() const { return true; }

  // All that it may write into a folder: names of files, and of folders of its own.
  virtual std::vector<std::string> Names() const = 0;

  // Writes files into an existing folder and returns their paths. Throws OutputError, and
  // StoppedError when progress says so.
  virtual std::vector<std::string> Write(const std::string& folder, const MapResult& map,
                                         const Progress& progress) const = 0;
};

// Where maps of poses that were given far from their origin, as in UTM, lie: what files can say.

inline bool IsFar(const MapSource& source) { return !source.world_offset_m.isZero(); }

// "world_offset_m 451200 5411300 312"; "" of maps that are where their poses were given.
inline std::string WorldOffsetNote(const Eigen::Vector3d& offset_m) {
  if (offset_m.isZero()) return "";
  return fmt::format("world_offset_m {:.0f} {:.0f} {:.0f}", offset_m.x(), offset_m.y(),
                     offset_m.z());
}

}  // namespace slcmap::exporting
