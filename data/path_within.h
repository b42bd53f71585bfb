// Paths as seen from the folder of a recording: runs name their images so.
#pragma once

#include <filesystem>
#include <string>

namespace slcmap {

// "" of none.
inline std::string PathWithin(const std::string& path, const std::string& folder) {
  return path.empty() ? "" : std::filesystem::path(path).lexically_relative(folder).string();
}

}  // namespace slcmap
