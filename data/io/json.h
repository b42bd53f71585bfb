// JSON files, with errors that name the file; summaries of stages' folders; points, polygons and
// verdicts. Include in .cc files only: the parser is a large header.
#pragma once

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "data/core/error.h"
#include "data/core/polygon.h"
#include "data/core/verdict.h"
#include "data/io/file.h"

namespace slcmap::inline data {

using Json = nlohmann::ordered_json;  // keys stay in the order in which they are written

// As files have it. Paths and texts of a recording can hold any bytes; JSON holds UTF-8.
inline std::string JsonText(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

// Throws OutputError.
inline void WriteJsonFile(const std::string& path, const Json& json) {
  WriteFile(path, JsonText(json));
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

// Checksums that tell whether bytes changed; they do not withstand forgery.

// Of bytes that come part by part. FNV-1a of 64 bits: http://www.isthe.com/chongo/tech/comp/fnv.
class RunningChecksum {
 public:
  void Add(std::string_view bytes) {
    for (const char c : bytes) hash_ = (hash_ ^ static_cast<uint8_t>(c)) * 0x100000001b3u;
  }
  std::string Text() const { return fmt::format("{:016x}", hash_); }  // 16 hexadecimal digits

 private:
  uint64_t hash_ = 0xcbf29ce484222325u;
};

inline std::string Checksum(std::string_view bytes) {
  RunningChecksum checksum;
  checksum.Add(bytes);
  return checksum.Text();
}

// The JSON summaries of stages' folders: they list the folder's other files with their checksums,
// and hold one of themselves, so that whatever changed since they were written is noticed. Include
// in .cc files only.

// What messages of files that are not as they were written end in.
inline constexpr char kChangedSince[] =
    "written by another run or changed since; --accept-changed takes it";

// The list of those files in the folder, for a summary's key "files". Throws DataError.
Json ListFiles(const std::string& folder, const std::vector<std::string>& names);

// An id that says what a folder holds: that of the summary with its list of files. The same
// contents have the same id.
std::string ComputeId(const Json& summary);

// Writes a summary with the keys "id", which is returned, and "checksum" added. Throws OutputError.
std::string WriteSummaryFile(const std::string& path, Json summary);

// Throws DataError unless the summary and each file that it lists are as they were written.
void CheckFiles(const std::string& folder, const std::string& summary_name, const Json& summary);

// Throws DataError unless the summary itself is as it was written.
void CheckSummary(const std::string& folder, const std::string& summary_name, const Json& summary);

// Throws DataError unless the number of rows that were read is that in the summary's "counts".
void CheckCount(const std::string& folder, const std::string& summary_name, const Json& summary,
                const char* what, std::size_t found);

// To a hundredth of a millimetre: more says nothing of a building.
inline double RoundedForJson(double value) { return std::round(value * 1e5) / 1e5; }

template <typename Point>
Json PointJson(const Point& point) {
  Json json = Json::array();
  for (const double value : point) json.push_back(RoundedForJson(value));
  return json;
}

template <typename Point>
Json PointsJson(const std::vector<Point>& points) {
  Json json = Json::array();
  for (const Point& point : points) json.push_back(PointJson(point));
  return json;
}

// Throws DataError naming the place unless there are as many finite numbers as the point takes,
// none beyond `most_m`.
template <typename Point>
Point ParsePoint(const std::string& place, const Json& json, double most_m) {
  const auto values = json.get<std::vector<double>>();
  Point point;
  bool holds = values.size() == static_cast<size_t>(point.size());
  for (size_t i = 0; holds && i < values.size(); ++i) {
    point[static_cast<Eigen::Index>(i)] = values[i];
    holds = std::abs(values[i]) <= most_m;
  }
  if (holds) return point;
  throw DataError(fmt::format("{}: found the point {}, expected {} numbers within {} m", place,
                              json.dump(), point.size(), most_m));
}

// The points under a key, at least `least`.
template <typename Point>
std::vector<Point> ParsePoints(const std::string& place, const Json& json, const char* key,
                               size_t least, double most_m) {
  std::vector<Point> points;
  for (const Json& point : json.at(key)) points.push_back(ParsePoint<Point>(place, point, most_m));
  if (points.size() >= least) return points;
  throw DataError(fmt::format("{}: {}: found {} points, expected at least {}", place, key,
                              points.size(), least));
}

inline Json HolesJson(const Polygon& polygon) {
  Json json = Json::array();
  for (const PlanPoints& hole : polygon.holes) json.push_back(PointsJson(hole));
  return json;
}

// The keys "outline" and "holes".
inline Polygon ParsePolygon(const std::string& place, const Json& json, double most_m) {
  Polygon polygon;
  polygon.outline = ParsePoints<Eigen::Vector2d>(place, json, "outline", 3, most_m);
  for (const Json& hole : json.at("holes")) {
    polygon.holes.push_back(
        ParsePoints<Eigen::Vector2d>(place, Json{{"hole", hole}}, "hole", 3, most_m));
  }
  return polygon;
}

// {level, reasons: [{level, what, found, expected, remedy}]}; null of a run that was not judged.
Json VerdictJson(const std::optional<Verdict>& verdict);

// The key "verdict" of a summary, which may lack it. Throws DataError naming `path`.
std::optional<Verdict> ParseVerdict(const std::string& path, const Json& summary);

}  // namespace slcmap::data
