// How a map lies on a surveyor's control points, and its files in a map folder: georeference.json
// and, the same as a table for people, control_points.csv.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "data/core/coordinate_system.h"

namespace slcmap::inline mapping {

enum class ControlStatus { kUsed, kOutlier, kUnseen };
inline constexpr std::array<const char*, 3> kControlStatuses = {"used", "outlier", "unseen"};

// A control point: easting, northing and height as they were given, and how far the map has it from
// there.
struct ControlResidual {
  std::string name;
  ControlStatus status = ControlStatus::kUnseen;
  Eigen::Vector3d given_m = Eigen::Vector3d::Zero(), sigma_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d off_m = Eigen::Vector3d::Zero();  // mapped minus given
  double over_sigma = 0;  // the largest of the three, by what is known of point and map
  int views = 0;          // images that it was seen in
};

// Between two points, both seen.
struct DistanceResidual {
  std::string from, to;
  double given_m = 0, mapped_m = 0, sigma_m = 0;  // of the mapped one
};

struct ControlFit {
  std::vector<ControlResidual> points;
  std::vector<DistanceResidual> distances;
  double rms_m = 0;  // of the three coordinates together, over those points that were used
  // Metres of the map to a metre of the ground, as the points that were used have it.
  double map_scale = 1, map_scale_sigma = 0;
};

inline constexpr std::array<const char*, 2> kControlFiles = {"georeference.json",
                                                             "control_points.csv"};

// Throws OutputError.
void WriteControlFit(const std::string& folder, const ControlFit& fit,
                     const std::optional<Georeference>& georeference);

// Throws DataError naming the file and what is wrong in it.
ControlFit ReadControlFit(const std::string& folder);

}  // namespace slcmap::mapping
