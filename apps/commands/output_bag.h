// A bag as the output of a command: how it is packed, and that it is there whole or not at all.
#pragma once

#include <string>

#include "data/bag/bag.h"

namespace slcmap::inline commands {

inline constexpr const char* kFolder = "folder";  // what is no bag, as a form

// By the output's name, and what --packing says otherwise. Throws ConfigError.
BagPacking ParsePacking(const std::string& output, const std::string& text);

// Makes something at a path of its own beside the output, and puts it in place when it is whole.
class OutputBag {
 public:
  // A db3 is a folder, or by its ending the file in it. Throws ConfigError where something is there
  // that would be lost, or where `input` would.
  OutputBag(const std::string& path, const BagPacking& packing, const std::string& input);
  ~OutputBag();
  OutputBag(const OutputBag&) = delete;
  OutputBag& operator=(const OutputBag&) = delete;

  // Where it is made. What else is made for it has this name with more behind it.
  std::string Begin();

  void Commit() const;  // throws OutputError

 private:
  void RefuseFilesOfOthers(const std::string& input) const;

  std::string path_, aside_, name_;
  bool is_folder_ = false, is_file_of_folder_ = false, is_begun_ = false;
};

}  // namespace slcmap::commands
