// Files that are read and written whole, with errors that name the file, or part by part; paths;
// text as it stands in XML and HTML; and where the program is, and the files that are installed
// with it: the page that maps are put into, the rigs of the simulator.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace slcmap::inline data {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using FileHandle = std::unique_ptr<std::FILE, CloseFile>;

// A file that is written part by part; small parts are gathered.

class FileWriter {
 public:
  // Makes the file anew. Throws OutputError where it cannot be made.
  explicit FileWriter(std::string path);

  // Throws OutputError when the bytes cannot be written whole, as on a full disk.
  void Add(std::string_view bytes);

  // Writes over bytes that were added, such as a header that says where the rest is.
  void Overwrite(int64_t at, std::string_view bytes);

  // To be called at the end: what is still buffered is written, and a full disk may first show
  // here. Throws OutputError then.
  void Close();

 private:
  [[noreturn]] void Fail(const char* what) const;

  std::string path_;
  FileHandle file_;
};

// The bytes of a file. Throws DataError when it is missing, is a folder, pipe or device, or cannot
// be read.
std::string ReadFile(const std::string& path);

// A text without the UTF-8 byte order mark that some editors put at its start.
std::string WithoutByteOrderMark(std::string text);

// Adds a number as the memory holds it.
template <typename Number>
void AppendBytes(Number value, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof value);
}

// Writes a file anew. Throws OutputError when it cannot be written whole, as on a full disk.
void WriteFile(const std::string& path, std::string_view bytes);

// The path that a symbolic link leads to, whether something is there or not; any other path as it
// is.
std::string LinkTarget(const std::string& path);

// What stands at a path, a link's target: "" for a file or nothing, else "a folder", "a pipe" ...
std::string NoFileAt(const std::string& path);

// Writes a file anew, all of it or, where that fails, what was there before stays. A symbolic link
// stays as well: its target is replaced. Throws OutputError, also where something stands that is no
// file, as a pipe or a device.
void ReplaceFile(const std::string& path, std::string_view bytes);

// The path of a folder, there or not, in full: without links, "." and a slash at its end.
std::string FolderItself(const std::string& path);

// Makes a folder and those above it. Throws OutputError where that fails.
void MakeFolder(const std::string& path);

// Paths as seen from the folder of a recording: runs name their images so.

// "" of none.
inline std::string PathWithin(const std::string& path, const std::string& folder) {
  return path.empty() ? "" : std::filesystem::path(path).lexically_relative(folder).string();
}

// Text as it stands in XML and HTML, in content and in quoted attributes.

std::string EscapeMarkup(const std::string& text);

// The file that holds this code: the program's, or that of a shared library which another program
// has loaded, as Python does with its modules. As the system names it; it can be read.
std::string ProgramFile();

// The path of what is installed as share/slcmap/NAME, a file or a folder, in a folder above that of
// the program file: of /usr/bin/slcmap it is /usr/share/slcmap/NAME, of build/bin/slcmap the one in
// build. "" where there is none.
//
//   FindSharedFile("page/page.html")
std::string FindSharedFile(const std::string& name);

// The folder config/ that is installed with the program, or that of the sources.
std::string ConfigFolder();

}  // namespace slcmap::data
