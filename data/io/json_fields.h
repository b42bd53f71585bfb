// What a JSON object holds, said once for writing and for reading: for a struct T there is
//
//   template <typename Fields>
//   void Describe(Fields& fields, Of<T> auto& thing) {
//     fields.Integer("id", thing.id, 0, kMostId);
//     ...
//   }
//
// (beside the type, as it is found by that) whose fields are a JsonWriter's, which takes a const T,
// or a JsonReader's. Include in .cc files only.
#pragma once

#include <cmath>
#include <concepts>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "data/core/math.h"
#include "data/io/json.h"

namespace slcmap::inline data {

template <typename Thing, typename Type>
concept Of = std::same_as<std::remove_const_t<Thing>, Type>;

// Rounds to so many parts of one.
inline constexpr double kHundredthsOfMm = 1e5, kMicrometres = 1e6, kExact = 0;

class JsonWriter {
 public:
  Json json = Json::object();

  void Integer(const char* key, const auto& value, int64_t, int64_t) { json[key] = value; }
  void Number(const char* key, double value, double, double, double parts = kHundredthsOfMm) {
    json[key] = Rounded(value, parts);
  }
  void Millimetres(const char* key, double metres, double, double) {
    json[key] = std::round(1e5 * metres) / 100;
  }
  void Optional(const char* key, const std::optional<double>& value, double, double) {
    json[key] = value ? Json(RoundedForJson(*value)) : Json();
  }
  void Value(const char* key, const auto& value) { json[key] = value; }
  // Only what says something.
  template <typename T>
  void Said(const char* key, const T& value) {
    if (value != T()) json[key] = value;
  }
  void SaidList(const char* key, const auto& things) {
    if (!things.empty()) List(key, things);
  }
  void Named(const char* key, const auto& kind, const auto& names) {
    json[key] = names[static_cast<size_t>(kind)];
  }
  void Point(const char* key, const auto& point, double) { json[key] = PointJson(point); }
  void Unit(const char* key, const auto& unit, double, double parts = kExact) {
    json[key] = Json::array();
    for (const double value : unit) json[key].push_back(Rounded(value, parts));
  }
  void Range(const char* key, const Interval& range, double) {
    json[key] = {RoundedForJson(range.from_m), RoundedForJson(range.to_m)};
  }
  void Points(const char* key, const auto& points, size_t, double) {
    json[key] = PointsJson(points);
  }
  void Outline(const Polygon& polygon, double) {
    json["outline"] = PointsJson(polygon.outline);
    json["holes"] = HolesJson(polygon);
  }
  void Derived(const char* key, double value) { json[key] = RoundedForJson(value); }
  void List(const char* key, const auto& things) { json[key] = WriteList(things); }
  void Place(const char*, const auto&) {}

  static Json Write(const auto& thing) {
    JsonWriter fields;
    Describe(fields, thing);
    return std::move(fields.json);
  }
  static Json WriteList(const auto& things) {
    Json list = Json::array();
    for (const auto& thing : things) list.push_back(Write(thing));
    return list;
  }

 private:
  static double Rounded(double value, double parts) {
    return parts > 0 ? std::round(value * parts) / parts : value;
  }
};

// Throws DataError, naming the place and the key, for a value out of its range, and what
// nlohmann::json throws for one that is missing or of another type.
class JsonReader {
 public:
  JsonReader(std::string place, const Json& json) : place_(std::move(place)), json_(json) {}

  template <typename T>
  void Integer(const char* key, T& value, int64_t least, int64_t most) const {
    value = static_cast<T>(BoundedAt<int64_t>(place_, json_, key, least, most));
  }
  void Number(const char* key, double& value, double least, double most, double = 0) const {
    value = BoundedAt(place_, json_, key, least, most);
  }
  void Millimetres(const char* key, double& metres, double least, double most) const {
    metres = 1e-3 * BoundedAt(place_, json_, key, 1e3 * least, 1e3 * most);
  }
  void Optional(const char* key, std::optional<double>& value, double least, double most) const {
    value.reset();
    if (!json_.at(key).is_null()) value = BoundedAt(place_, json_, key, least, most);
  }
  template <typename T>
  void Value(const char* key, T& value) const {
    value = json_.at(key).get<T>();
  }
  template <typename T>
  void Said(const char* key, T& value) const {
    value = json_.value(key, T());
  }
  template <typename T>
  void SaidList(const char* key, std::vector<T>& things) const {
    if (json_.contains(key)) List(key, things);
  }
  template <typename Kind>
  void Named(const char* key, Kind& kind, const auto& names) const {
    const auto found = json_.at(key).get<std::string>();
    for (size_t i = 0; i < names.size(); ++i) {
      if (found != names[i]) continue;
      kind = static_cast<Kind>(i);
      return;
    }
    throw DataError(fmt::format("{}: {}: found '{}', expected one of: {}", place_, key, found,
                                fmt::join(names, ", ")));
  }
  template <typename P>
  void Point(const char* key, P& point, double most) const {
    point = ParsePoint<P>(place_, json_.at(key), most);
  }
  template <typename P>
  void Unit(const char* key, P& unit, double slack, double = 0) const {
    unit = ParsePoint<P>(place_, json_.at(key), 1 + slack);
    if (std::abs(unit.norm() - 1) <= slack) return;
    throw DataError(
        fmt::format("{}: {}: found a length of {}, expected 1", place_, key, unit.norm()));
  }
  void Range(const char* key, Interval& range, double most) const {
    const auto ends = ParsePoint<Eigen::Vector2d>(place_, json_.at(key), most);
    range = {ends.x(), ends.y()};
    if (range.from_m <= range.to_m) return;
    throw DataError(fmt::format("{}: {}: found {} to {}, expected the lesser first", place_, key,
                                range.from_m, range.to_m));
  }
  template <typename P>
  void Points(const char* key, std::vector<P>& points, size_t least, double most) const {
    points = ParsePoints<P>(place_, json_, key, least, most);
  }
  void Outline(Polygon& polygon, double most) const { polygon = ParsePolygon(place_, json_, most); }
  void Derived(const char*, double) const {}
  template <typename T>
  void List(const char* key, std::vector<T>& things) const {
    things = ReadList<T>(place_, json_.at(key));
  }
  // Messages name the thing from here on.
  void Place(const char* what, const auto& id) { place_ += fmt::format(": {} {}", what, id); }

  template <typename T>
  static T Read(const std::string& place, const Json& json) {
    T thing;
    JsonReader fields(place, json);
    Describe(fields, thing);
    return thing;
  }
  template <typename T>
  static std::vector<T> ReadList(const std::string& place, const Json& list) {
    std::vector<T> things;
    for (const Json& json : list) things.push_back(Read<T>(place, json));
    return things;
  }

 private:
  std::string place_;
  const Json& json_;
};

}  // namespace slcmap::data
