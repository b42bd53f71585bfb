#include "apps/page_file.h"

#include <spdlog/spdlog.h>

#include <filesystem>
#include <fstream>
#include <string_view>

#include "data/error.h"
#include "data/file.h"

namespace slcmap {
namespace {

// What all pages of maps hold before the map, so that a page is known whatever else it shows.
constexpr std::string_view kPageBegin = "<!doctype html>", kPageTitle = "<title>slcmap</title>",
                           kPageMap = "<script id=\"map\" type=\"text/plain\">";
constexpr std::streamsize kBytesBeforeMap = 1 << 17;  // about ten times as many as there are

// A page of a map, as slcmap writes it.
bool IsPage(const std::string& path) {
  std::string text(kBytesBeforeMap, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(text.data(), kBytesBeforeMap);
  text.resize(static_cast<std::size_t>(file.gcount()));
  return text.starts_with(kPageBegin) && text.find(kPageTitle) != text.npos &&
         text.find(kPageMap) != text.npos;
}

}  // namespace

std::string TitleOfMap(const std::string& folder) {
  const std::filesystem::path path = std::filesystem::weakly_canonical(folder + "/.");
  const std::filesystem::path self = path.has_filename() ? path : path.parent_path();
  const bool has_name = self.filename() != "map" || !self.parent_path().has_filename();
  return (has_name ? self : self.parent_path()).filename().string();
}

void CheckPagePlace(const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    throw ConfigError(fmt::format("output {}: found a folder, expected a file's name, such as {}",
                                  path, (std::filesystem::path(path) / "map.html").string()));
  }
  if (const std::string found = NoFileAt(path); !found.empty()) {
    throw ConfigError(fmt::format("output {}: found {}, expected a file", path, found));
  }
  if (!std::filesystem::exists(path, error) || IsPage(path)) return;
  throw ConfigError(fmt::format(
      "output {}: found a file that is no page of a map by slcmap, expected a new name: it would "
      "be overwritten",
      path));
}

void RemovePage(const std::string& path) {
  std::error_code ignored;
  if (IsPage(path)) std::filesystem::remove(LinkTarget(path), ignored);
}

void WritePage(const MapResult& map, const std::string& page_template, const PageOptions& options,
               const std::vector<PageImage>& images, const std::string& path,
               const Progress& progress) {
  const std::string page = MakePage(map, page_template, options, images, progress);
  CheckPagePlace(path);  // again: that took a while
  ReplaceFile(path, page);
  spdlog::info("wrote {} ({:.1f} MB): open it in a browser", path,
               static_cast<double>(page.size()) * 1e-6);
}

}  // namespace slcmap
