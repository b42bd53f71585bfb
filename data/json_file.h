// JSON files, with errors that name the file. Include in .cc files only: the parser is a large
// header.
#pragma once

#include <spdlog/fmt/fmt.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>

#include "data/error.h"
#include "data/file.h"

namespace slcmap {

using Json = nlohmann::ordered_json;  // keys stay in the order in which they are written

// Throws OutputError.
inline void WriteJsonFile(const std::string& path, const Json& json) {
  // Paths and texts of a recording can hold any bytes; JSON holds UTF-8.
  WriteFile(path, json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

// What is wrong, in this project's words: the library's hold its own names and numbers.
inline std::string JsonProblem(const nlohmann::json::exception& error) {
  if (const auto* parsing = dynamic_cast<const nlohmann::json::parse_error*>(&error)) {
    return fmt::format("found no valid JSON at byte {}, expected it to be whole", parsing->byte);
  }
  // "... key 'name' not found" is the only place that holds the missing key.
  const std::string text = error.what();
  const size_t from = text.find("key '"), to = text.rfind("' not found");
  if (from != std::string::npos && to != std::string::npos && from + 5 <= to) {
    return text.substr(from + 5, to - from - 5) + ": missing, expected in this file";
  }
  return "found a value of a wrong type, or too few of them, expected the file as slcmap writes it";
}

// Calls and returns use(), which takes values out of the JSON of a file. Throws DataError naming
// the file when it lacks a key or has one of a wrong type where use asks for it.
template <typename Use>
auto WithJsonErrors(const std::string& path, Use use) {
  try {
    return use();
  } catch (const nlohmann::json::exception& error) {
    throw DataError(path + ": " + JsonProblem(error));
  }
}

// Calls parse(json) and returns its result. Throws DataError naming the file when it is missing, is
// not JSON, or lacks a key or has one of a wrong type where parse asks for it.
template <typename Parse>
auto ParseJsonFile(const std::string& path, Parse parse) {
  return WithJsonErrors(path, [&] { return parse(Json::parse(ReadFile(path))); });
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

// The number under a key. Throws DataError, naming `place` and the key, unless it is from `least`
// to `most`.
template <typename T>
T BoundedAt(const std::string& place, const Json& json, const char* key, T least, T most) {
  const Json& found = json.at(key);
  // A number is compared before it is cut to the type.
  const bool is_number = std::is_integral_v<T> ? found.is_number_integer() : found.is_number();
  const auto value = is_number ? found.get<double>() : std::numeric_limits<double>::quiet_NaN();
  if (value >= static_cast<double>(least) && value <= static_cast<double>(most)) {
    return found.get<T>();
  }
  throw DataError(
      fmt::format("{}: {}: found {}, expected {} to {}", place, key, found.dump(), least, most));
}

}  // namespace slcmap
