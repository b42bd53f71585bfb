#include "apps/page_file.h"

#include <spdlog/spdlog.h>

#include <filesystem>

#include "data/error.h"
#include "data/file.h"

namespace slcmap {
namespace {

// All of it or, where that fails, what was there before.
void ReplaceFile(const std::string& path, const std::string& bytes) {
  const std::string aside = path + ".unfinished";
  std::error_code error, ignored;
  try {
    WriteFile(aside, bytes);
  } catch (...) {
    std::filesystem::remove(aside, ignored);
    throw;
  }
  std::filesystem::rename(aside, path, error);
  if (!error) return;
  std::filesystem::remove(aside, ignored);
  throw OutputError(fmt::format("{}: cannot be replaced: {}", path, error.message()));
}

}  // namespace

std::string TitleOfMap(const std::string& folder) {
  const std::filesystem::path path = std::filesystem::weakly_canonical(folder + "/.");
  const std::filesystem::path self = path.has_filename() ? path : path.parent_path();
  const bool has_name = self.filename() != "map" || !self.parent_path().has_filename();
  return (has_name ? self : self.parent_path()).filename().string();
}

void WritePage(const MapResult& map, const std::string& page_template, const PageOptions& options,
               const std::vector<PageImage>& images, const std::string& path,
               const Progress& progress) {
  const std::string page = MakePage(map, page_template, options, images, progress);
  ReplaceFile(path, page);
  spdlog::info("wrote {} ({:.1f} MB): open it in a browser", path,
               static_cast<double>(page.size()) * 1e-6);
}

}  // namespace slcmap
