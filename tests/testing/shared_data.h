// Recordings that are not part of the project, where they are there.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace slcmap::testing {

// The path of a recording under $SLCMAP_SHARED/data, or in a folder shared/data beside the source
// tree or one above; "" where it is not there, and the test is to be skipped.
inline std::string SharedData(const std::string& name) {
  namespace fs = std::filesystem;
  const char* shared = std::getenv("SLCMAP_SHARED");
  const fs::path source = SLCMAP_SOURCE_DIR;
  for (const fs::path& root :
       {fs::path(shared != nullptr ? shared : ""), source / "../shared", source / "../../shared"}) {
    const fs::path path = root / "data" / name;
    if (!root.empty() && fs::exists(path)) return path.lexically_normal().string();
  }
  return "";
}

}  // namespace slcmap::testing
