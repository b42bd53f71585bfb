#include "apps/page_template.h"

#include <spdlog/fmt/fmt.h>

#include <filesystem>

#include "data/error.h"
#include "data/file.h"

namespace slcmap {

std::string ReadPageTemplate() {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path path = program.parent_path().parent_path() / "share/slcmap/page/page.html";
  if (fs::is_regular_file(path, error)) return ReadFile(path);
  throw DataError(fmt::format(
      "{}: found no page, expected the one that is made with the program: build it again where npm "
      "is installed and can fetch packages",
      path.string()));
}

}  // namespace slcmap
