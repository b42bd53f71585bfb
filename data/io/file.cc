#include "data/io/file.h"

#include <dlfcn.h>
#include <link.h>
#include <spdlog/fmt/fmt.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <utility>

#include "data/core/error.h"

namespace slcmap::inline data {

FileWriter::FileWriter(std::string path) : path_(std::move(path)) {
  file_.reset(std::fopen(path_.c_str(), "wb"));
  if (!file_) Fail("created");
}

void FileWriter::Add(std::string_view bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size()) Fail("written");
}

void FileWriter::Overwrite(int64_t at, std::string_view bytes) {
  if (fseeko(file_.get(), at, SEEK_SET) != 0) Fail("written");
  Add(bytes);
  if (fseeko(file_.get(), 0, SEEK_END) != 0) Fail("written");
}

void FileWriter::Close() {
  if (std::fclose(file_.release()) != 0) Fail("written");
}

void FileWriter::Fail(const char* what) const {
  throw OutputError(fmt::format("{}: cannot be {}: {}", path_, what, std::strerror(errno)));
}

namespace fs = std::filesystem;

std::string ReadFile(const std::string& path) {
  if (const std::string found = NoFileAt(path); !found.empty()) {
    throw DataError(fmt::format("{}: found {}, expected a file", path, found));  // a pipe may wait
  }
  const FileHandle file(std::fopen(path.c_str(), "rb"));
  if (!file) throw DataError(fmt::format("{}: cannot be opened: {}", path, std::strerror(errno)));
  std::string bytes;
  char block[1 << 16];
  while (const std::size_t count = std::fread(block, 1, sizeof block, file.get())) {
    bytes.append(block, count);
  }
  if (std::ferror(file.get())) {
    throw DataError(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
  }
  return bytes;
}

std::string WithoutByteOrderMark(std::string text) {
  constexpr std::string_view kMark = "\xef\xbb\xbf";
  if (text.compare(0, kMark.size(), kMark) == 0) text.erase(0, kMark.size());
  return text;
}

void WriteFile(const std::string& path, std::string_view bytes) {
  FileWriter file(path);
  file.Add(bytes);
  file.Close();
}

std::string LinkTarget(const std::string& path) {
  constexpr int kMostLinks = 40;  // as Linux follows them
  fs::path target = path;
  std::error_code error;
  for (int i = 0; i < kMostLinks && fs::is_symlink(target, error); ++i) {
    target = target.parent_path() / fs::read_symlink(target, error);
  }
  return target.string();
}

std::string NoFileAt(const std::string& path) {
  std::error_code error;
  switch (fs::status(path, error).type()) {
    case fs::file_type::none:
    case fs::file_type::not_found:
    case fs::file_type::regular:
      return "";
    case fs::file_type::directory:
      return "a folder";
    case fs::file_type::fifo:
      return "a pipe";
    case fs::file_type::socket:
      return "a socket";
    default:
      return "a device";
  }
}

void ReplaceFile(const std::string& path, std::string_view bytes) {
  if (const std::string found = NoFileAt(path); !found.empty()) {
    throw OutputError(fmt::format("{}: found {}, expected a file", path, found));
  }
  const std::string target = LinkTarget(path), aside = target + ".unfinished";
  std::error_code error, ignored;
  try {
    WriteFile(aside, bytes);
  } catch (...) {
    fs::remove(aside, ignored);
    throw;
  }
  fs::rename(aside, target, error);
  if (!error) return;
  fs::remove(aside, ignored);
  throw OutputError(fmt::format("{}: cannot be replaced: {}", path, error.message()));
}

std::string FolderItself(const std::string& path) {
  const fs::path canonical = fs::weakly_canonical(fs::absolute(path + "/."));
  return canonical.has_filename() ? canonical : canonical.parent_path();
}

void MakeFolder(const std::string& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error || !fs::is_directory(path)) {
    throw OutputError(fmt::format("{}: folder cannot be made: {}", path,
                                  error ? error.message() : "a file is in its place"));
  }
}

std::string EscapeMarkup(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

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
