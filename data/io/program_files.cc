#include "data/io/program_files.h"

#include <dlfcn.h>
#include <link.h>

#include <filesystem>

namespace slcmap::inline data {

namespace fs = std::filesystem;

std::string ProgramFile() {
  constexpr char kThisProcess[] = "/proc/self/exe";
  Dl_info info;
  link_map* map = nullptr;
  const int found = dladdr1(reinterpret_cast<const void*>(&ProgramFile), &info,
                            reinterpret_cast<void**>(&map), RTLD_DL_LINKMAP);
  // That of the program itself has no name.
  return found == 0 || map->l_name[0] == '\0' ? kThisProcess : map->l_name;
}

std::string FindSharedFile(const std::string& name) {
  std::error_code error;
  fs::path folder = fs::canonical(ProgramFile(), error).parent_path();
  while (folder.has_relative_path()) {
    folder = folder.parent_path();
    const fs::path path = folder / "share/slcmap" / name;
    if (fs::exists(path, error)) return path.string();
  }
  return "";
}

std::string ConfigFolder() {
  const std::string installed = FindSharedFile("config");
  return installed.empty() ? SLCMAP_CONFIG_FOLDER : installed;
}

}  // namespace slcmap::data
