#include "mapping/map/place_index.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "data/io/csv.h"
#include "data/io/file.h"
#include "data/io/map_line.h"
#include "data/io/trajectory.h"
#include "odometry/run/run_rows.h"

namespace slcmap::inline mapping {
namespace {

// Shorter ones are many, and tell little.
constexpr double kShortestUpright_m = 0.4, kShortestLevel_m = 0.8;
constexpr double kUprightCosine = 0.98, kLevelCosine = 0.1;
constexpr double kBetweenPlacesOfWalk_m = 1;

constexpr int kWalk = 0, kEdge = 1;

bool IsTelling(const MapLine& line) {
  const double length_m = (line.end_world - line.start_world).norm();
  const double vertical = std::abs(line.end_world.z() - line.start_world.z()) / length_m;
  if (vertical > kUprightCosine) return length_m >= kShortestUpright_m;
  return vertical < kLevelCosine && length_m >= kShortestLevel_m;
}

}  // namespace

PlaceIndex MakePlaceIndex(const MapResult& map) {
  PlaceIndex index;
  std::ranges::copy_if(map.lines, std::back_inserter(index.edges), IsTelling);
  for (const StampedPose& pose : map.trajectory) {
    const Eigen::Vector3d& p = pose.T_world_imu.translation;
    if (index.walk_world.empty() ||
        (p - index.walk_world.back()).norm() >= kBetweenPlacesOfWalk_m) {
      index.walk_world.push_back(p);
    }
  }
  return index;
}

namespace {

const CsvColumns& PlaceColumns() {
  using Kind = CsvColumn::Kind;
  static const CsvColumns columns = [] {
    CsvColumns all = {{"is_edge", Kind::kInteger, 0, 1}};
    for (const char* name :
         {"start_x_m", "start_y_m", "start_z_m", "end_x_m", "end_y_m", "end_z_m"}) {
      all.push_back({name, Kind::kNumber, -kMaxCoordinate_m, kMaxCoordinate_m});
    }
    return all;
  }();
  return columns;
}

std::string FormatPlace(int kind, const Eigen::Vector3d& start, const Eigen::Vector3d& end) {
  return fmt::format("{},{:.2f},{:.2f},{:.2f},{:.2f},{:.2f},{:.2f}\n", kind, start.x(), start.y(),
                     start.z(), end.x(), end.y(), end.z());
}

Eigen::Vector3d PointAt(const CsvTable& row, std::size_t column) {
  return {row.Number(0, column), row.Number(0, column + 1), row.Number(0, column + 2)};
}

}  // namespace

void WritePlaceIndex(const std::string& path, const PlaceIndex& index) {
  std::string text = CsvHeader(PlaceColumns()) + "\n";
  for (const Eigen::Vector3d& p : index.walk_world) text += FormatPlace(kWalk, p, p);
  for (const MapLine& edge : index.edges) {
    text += FormatPlace(kEdge, edge.start_world, edge.end_world);
  }
  WriteFile(path, text);
}

PlaceIndex ReadPlaceIndex(const std::string& folder) {
  const std::string path = folder + "/" + kPlaceFile;
  PlaceIndex index;
  CsvTable::ForEach(path, PlaceColumns(), [&](const CsvTable& row) {
    if (row.Int(0, 0) == kWalk) {
      index.walk_world.push_back(PointAt(row, 1));
    } else {
      index.edges.push_back({.start_world = PointAt(row, 1), .end_world = PointAt(row, 4)});
    }
  });
  return index;
}

}  // namespace slcmap::mapping
