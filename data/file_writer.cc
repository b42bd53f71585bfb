#include "data/file_writer.h"

#include <spdlog/fmt/fmt.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "data/error.h"

namespace slcmap {

FileWriter::FileWriter(std::string path) : path_(std::move(path)) {
  file_.reset(std::fopen(path_.c_str(), "wb"));
  if (!file_) Fail("created");
}

void FileWriter::Add(std::string_view bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size()) Fail("written");
}

void FileWriter::Close() {
  if (std::fclose(file_.release()) != 0) Fail("written");
}

void FileWriter::Fail(const char* what) const {
  throw OutputError(fmt::format("{}: cannot be {}: {}", path_, what, std::strerror(errno)));
}

}  // namespace slcmap
