// Points and polygons in JSON. Include in .cc files only.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "data/json_file.h"
#include "data/polygon.h"

namespace slcmap {

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

}  // namespace slcmap
