// What fuzz targets share. A target is a file of its own that feeds a reader with bytes: it defines
// LLVMFuzzerTestOneInput(), which any engine of that interface can drive; driver.cc is ours.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "data/core/error.h"
#include "data/io/file.h"
#include "tests/testing/temp_folder.h"

// Reads bytes; returns 0. What must not happen (a crash, a foreign exception) ends the process.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size);

namespace slcmap::fuzz {

// Inputs that a target makes by itself, beside those of its corpus. Defined by every target.
std::vector<std::string> Seeds();

// The files of a folder, by name.
inline std::vector<std::string> CollectFiles(const std::string& folder) {
  std::vector<std::string> paths, files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    paths.push_back(entry.path().string());
  }
  std::sort(paths.begin(), paths.end());
  for (const std::string& path : paths) files.push_back(ReadFile(path));
  return files;
}

[[noreturn]] inline void Finding(const char* what, const char* message) {
  std::fprintf(stderr, "finding: %s: '%s'\n", what, message);
  std::abort();
}

// Calls read(), which may refuse what it reads, but only in this project's way: by an Error of one
// line.
template <typename Read>
void Refusing(Read read) {
  try {
    read();
  } catch (const Error& error) {
    const std::string_view message = error.what();
    if (message.empty() || message.find('\n') != message.npos) {
      Finding("an error that is not one line", error.what());
    }
  } catch (const std::exception& error) {
    Finding("a foreign exception", error.what());
  }
}

// The path of a file with these bytes, good until the next call with that name.
inline std::string FileOf(const std::string& name, const uint8_t* bytes, size_t size) {
  static const testing::TempFolder folder;
  return folder.Write(name, std::string(reinterpret_cast<const char*>(bytes), size));
}

}  // namespace slcmap::fuzz
