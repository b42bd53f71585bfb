// Whole files in and out, with errors that name the file.
#pragma once

#include <string>
#include <string_view>

namespace slcmap {

// The bytes of a file. Throws DataError when it is missing or cannot be read.
std::string ReadFile(const std::string& path);

// A text without the UTF-8 byte order mark that some editors put at its start.
std::string WithoutByteOrderMark(std::string text);

// Writes a file anew. Throws OutputError when it cannot be written whole, as on a full disk.
void WriteFile(const std::string& path, std::string_view bytes);

// Makes a folder and those above it. Throws OutputError where that fails.
void MakeFolder(const std::string& path);

}  // namespace slcmap
