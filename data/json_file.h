// JSON files, with errors that name the file. Include in .cc files only: the parser is a large
// header.
#pragma once

#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>
#include <string>

#include "data/error.h"
#include "data/file.h"

namespace slcmap {

using Json = nlohmann::ordered_json;  // keys stay in the order in which they are written

// Throws OutputError.
inline void WriteJsonFile(const std::string& path, const Json& json) {
  WriteFile(path, json.dump(2) + "\n");
}

// Calls parse(json) and returns its result. Throws DataError naming the file when it is missing, is
// not JSON, or lacks a key or has one of a wrong type where parse asks for it.
template <typename Parse>
auto ParseJsonFile(const std::string& path, Parse parse) {
  try {
    return parse(Json::parse(ReadFile(path)));
  } catch (const nlohmann::json::exception& error) {
    throw DataError(fmt::format("{}: {}", path, error.what()));
  }
}

// The key "version". Throws DataError unless it is from `oldest` to `newest` and the key "format"
// is as expected.
inline int CheckFormat(const std::string& path, const Json& json, const std::string& format,
                       int oldest, int newest) {
  const auto found_format = json.at("format").get<std::string>();
  const int found_version = json.at("version").get<int>();
  if (found_format != format || found_version < oldest || found_version > newest) {
    throw DataError(fmt::format(
        "{}: found '{}' of version {}, expected '{}' of version {}", path, found_format,
        found_version, format,
        oldest == newest ? fmt::format("{}", newest) : fmt::format("{} to {}", oldest, newest)));
  }
  return found_version;
}

}  // namespace slcmap
