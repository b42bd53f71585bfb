// What a plan holds, as features with attributes for geographic information systems.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "data/core/polygon.h"
#include "mapping/map/map.h"

namespace slcmap::inline exporting {

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
