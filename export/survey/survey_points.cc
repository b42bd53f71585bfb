#include "export/survey/survey_points.h"

#include <spdlog/fmt/fmt.h>

#include <charconv>
#include <string_view>

#include "data/core/coordinate_system.h"
#include "data/core/error.h"

namespace slcmap::inline exporting {
namespace {

const std::vector<DensePoint>& SurfacePoints(const MapResult& map, PointSource source) {
  return source == PointSource::kFilled ? map.filled : map.dense;
}

SurveyPoint FromMap(const MapResult& map, PointSource source, std::size_t index) {
  if (source == PointSource::kLandmark) {
    const MapPoint& point = map.points[index];
    return {.p = point.p_world, .sigma_m = point.sigma_m, .source = source};
  }
  const DensePoint& point = SurfacePoints(map, source)[index];
  return {point.p_world, point.normal_world, point.sigma_m, point.grey, source};
}

}  // namespace

const char* GetName(PointSource source) {
  switch (source) {
    case PointSource::kStereo:
      return "stereo";
    case PointSource::kFilled:
      return "filled";
    case PointSource::kLandmark:
      break;
  }
  return "landmarks";
}

std::size_t CountPoints(const MapResult& map, PointSource source) {
  return source == PointSource::kLandmark ? map.points.size() : SurfacePoints(map, source).size();
}

SurveyPoint PointAt(const MapResult& map, PointSource source, std::size_t index) {
  SurveyPoint point = FromMap(map, source, index);
  if (point.p.allFinite() && point.normal.allFinite()) return point;
  throw DataError(
      fmt::format("map: point {} of {}: found a number that is not finite, expected "
                  "metres: make the map again",
                  index, GetName(source)));
}

Georeference FindPlace(const MapSource& source) {
  return source.georeference.value_or(Georeference());
}

Eigen::Vector3d TurnedNormal(const Georeference& place, const Eigen::Vector3d& normal) {
  return Eigen::AngleAxisd(place.turn_rad, Eigen::Vector3d::UnitZ()) * normal;
}

int EpsgCode(const std::string& crs) {
  constexpr std::string_view kAuthority = "EPSG:";
  if (!crs.starts_with(kAuthority)) return 0;
  int code = 0;
  const char* const end = crs.data() + crs.size();
  const auto [stop, error] = std::from_chars(crs.data() + kAuthority.size(), end, code);
  return error == std::errc() && (stop == end || *stop == '+') && code > 0 ? code : 0;
}

std::string CrsWkt(const Georeference& place) {
  if (!place.crs.empty()) return CoordinateSystem(place.crs).Wkt();
  return "LOCAL_CS[\"building, metres\",LOCAL_DATUM[\"building\",0],UNIT[\"metre\",1],"
         "AXIS[\"x\",EAST],AXIS[\"y\",NORTH]]";
}

}  // namespace slcmap::exporting
