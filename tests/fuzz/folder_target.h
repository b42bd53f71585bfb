// Targets that read a folder of which one file is another: the input's first byte says which.
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/fuzz/fuzz_target.h"

namespace slcmap::fuzz {

class FolderTarget {
 public:
  // write(path) fills a folder, and perhaps those in it, with good files.
  template <typename Write>
  explicit FolderTarget(Write write) {
    write(folder_.Path());
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_.Path())) {
      if (!entry.is_regular_file()) continue;
      names_.push_back(std::filesystem::relative(entry.path(), folder_.Path()).string());
    }
    std::sort(names_.begin(), names_.end());
    for (const std::string& name : names_) contents_.push_back(ReadFile(folder_.Path(name)));
  }

  std::vector<std::string> Seeds() const {
    std::vector<std::string> seeds;
    for (size_t i = 0; i < names_.size(); ++i) seeds.push_back(static_cast<char>(i) + contents_[i]);
    return seeds;
  }

  // Calls read(path) on the folder with the file of the input in the place of the good one.
  template <typename Read>
  void Run(const uint8_t* bytes, size_t size, Read read) const {
    if (size == 0) return;
    const size_t file = bytes[0] % names_.size();
    folder_.Write(names_[file], std::string(reinterpret_cast<const char*>(bytes) + 1, size - 1));
    Refusing([&] { read(folder_.Path()); });
    folder_.Write(names_[file], contents_[file]);
  }

 private:
  testing::TempFolder folder_;
  std::vector<std::string> names_, contents_;
};

}  // namespace slcmap::fuzz
