// The formats that a scene can be written in.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "data/progress.h"
#include "export/scene.h"

namespace slcmap {

// Writes scenes in one format.
class SceneWriter {
 public:
  virtual ~SceneWriter() = default;

  virtual std::string Format() const = 0;  // as named on the command line, such as "glb"

  // Writes files into an existing folder and returns their paths. Throws OutputError, and
  // StoppedError when progress says so.
  virtual std::vector<std::string> Write(const std::string& folder, const MapScene& scene,
                                         const Progress& progress) const = 0;
};

// A writer for each format there is.
std::vector<std::unique_ptr<SceneWriter>> MakeSceneWriters();

}  // namespace slcmap
