// The points of a map as surveyors' files hold them: those of its surfaces and its landmarks, in
// one order.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "data/core/coordinate_system.h"
#include "data/core/polygon.h"
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
int EpsgCodeOfHeights(const std::string& crs);  // of "EPSG:25832+7837": 7837; else 0

// OGC WKT of version 1 of the place's system; where it has none, of an engineering one.
std::string CrsWkt(const Georeference& place, bool with_heights = true);

// What a plan holds, as features with attributes for geographic information systems.

// Nothing where it is not known.
using Attribute = std::variant<std::monostate, bool, int64_t, double, std::string>;

// Either areas or a line, in metres of the map's place (FindPlace); z is 0 in plans.
struct StoreyFeature {
  std::optional<int64_t> storey;  // nothing in a building without storeys
  std::vector<Polygon> areas;
  std::vector<Eigen::Vector3d> line;
  std::vector<Attribute> attributes;  // in the order of the layer's columns
};

enum class FeatureGeometry { kAreas, kLine, kLineInSpace };
enum class ColumnType { kBoolean, kInteger, kReal, kText };

struct FeatureLayer {
  struct Column {
    const char* name;
    ColumnType type;
  };
  std::string name;
  std::string feature;  // what one of them is called
  FeatureGeometry geometry = FeatureGeometry::kAreas;
  std::vector<Column> columns;
  // Calls its argument with each feature, in the order of the map. Throws DataError for numbers
  // that are not finite.
  std::function<void(const std::function<void(const StoreyFeature&)>&)> visit;
};

Eigen::AlignedBox2d ComputeExtent(const StoreyFeature& feature);

// "walls" (areas between their openings), "rooms", "openings" (lines from jamb to jamb, in the
// middle of the wall's thickness) and "lines" (in space: edges, marks and the axes of pipes).
// Features are made one by one, out of the map, which has to live as long as the layers.
std::vector<FeatureLayer> MakeFeatureLayers(const MapResult& map);

}  // namespace slcmap::exporting
