// A folder that goes away again where nothing was put into it.
#pragma once

#include <string>
#include <vector>

namespace slcmap {

class MadeFolder {
 public:
  // Makes the folder and those above it, as far as they are missing. Throws OutputError.
  explicit MadeFolder(const std::string& path);

  // Removes those that were made here and are empty.
  ~MadeFolder();
  MadeFolder(const MadeFolder&) = delete;
  MadeFolder& operator=(const MadeFolder&) = delete;

 private:
  std::vector<std::string> made_;  // the deepest first
};

}  // namespace slcmap
