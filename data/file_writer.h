// A file that is written part by part; small parts are gathered.
#pragma once

#include <string>
#include <string_view>

#include "data/file_handle.h"

namespace slcmap {

class FileWriter {
 public:
  // Makes the file anew. Throws OutputError where it cannot be made.
  explicit FileWriter(std::string path);

  // Throws OutputError when the bytes cannot be written whole, as on a full disk.
  void Add(std::string_view bytes);

  // To be called at the end: what is still buffered is written, and a full disk may first show
  // here. Throws OutputError then.
  void Close();

 private:
  [[noreturn]] void Fail(const char* what) const;

  std::string path_;
  FileHandle file_;
};

}  // namespace slcmap
