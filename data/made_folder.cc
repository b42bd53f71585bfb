#include "data/made_folder.h"

#include <filesystem>

#include "data/file.h"

namespace slcmap {

namespace fs = std::filesystem;

MadeFolder::MadeFolder(const std::string& path) {
  std::error_code error;
  for (fs::path folder = path; !folder.empty() && !fs::exists(folder, error);
       folder = folder.parent_path()) {
    made_.push_back(folder.string());
  }
  MakeFolder(path);
}

MadeFolder::~MadeFolder() {
  std::error_code error;
  for (const std::string& folder : made_) fs::remove(folder, error);  // fails where not empty
}

}  // namespace slcmap
