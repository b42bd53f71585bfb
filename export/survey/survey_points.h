// The points of a map as surveyors' files hold them: those of its surfaces and its landmarks, in
// one order.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

#include "data/core/coordinate_system.h"
#include "mapping/map/map.h"

namespace slcmap::inline exporting {

// Files hold these numbers.
enum class PointSource : uint16_t {
  kStereo = 1,    // a surface that was measured
  kFilled = 2,    // derived: on a plane of the building, where nothing was measured
  kLandmark = 3,  // of the odometry and the adjustment, fused
};
inline constexpr std::array<PointSource, 3> kPointSources = {
    PointSource::kStereo, PointSource::kFilled, PointSource::kLandmark};
const char* GetName(PointSource source);

// Metres. A landmark has no normal (zero), and a middle grey as its own was not kept.
struct SurveyPoint {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double sigma_m = 0;
  uint8_t grey = 128;
  PointSource source = PointSource::kStereo;
};

inline constexpr std::size_t kPointsToReport = 65536;  // that are written between two reports

std::size_t CountPoints(const MapResult& map, PointSource source);

// In the world of the map. `index` is less than CountPoints. Throws DataError for a point that is
// not finite.
SurveyPoint PointAt(const MapResult& map, PointSource source, std::size_t index);

// Where the map lies; where that is not known, in a grid of its own.
Georeference FindPlace(const MapSource& source);

// The direction of a map's normal where it lies.
Eigen::Vector3d TurnedNormal(const Georeference& place, const Eigen::Vector3d& normal);

// Of a CRS such as "EPSG:25832", or "EPSG:25832+7837" with a system of heights, that of the plane;
// 0 of any other.
int EpsgCode(const std::string& crs);

// OGC WKT of version 1 of the place's system; where it has none, of an engineering one.
std::string CrsWkt(const Georeference& place);

}  // namespace slcmap::exporting
