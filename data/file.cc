#include "data/file.h"

#include <spdlog/fmt/fmt.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "data/error.h"
#include "data/file_handle.h"
#include "data/file_writer.h"

namespace slcmap {

std::string ReadFile(const std::string& path) {
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

void MakeFolder(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error || !std::filesystem::is_directory(path)) {
    throw OutputError(fmt::format("{}: folder cannot be made: {}", path,
                                  error ? error.message() : "a file is in its place"));
  }
}

}  // namespace slcmap
