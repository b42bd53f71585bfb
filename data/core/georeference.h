// Where the frame of a map lies on Earth, or in the grid of a surveyor.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>

namespace slcmap::inline data {

// A point p of the map, in metres with z up, is at origin_m + (p turned by turn_rad about z, x and
// y scaled) in the coordinate reference system.
struct Georeference {
  std::string crs;  // such as "EPSG:25832"; "" of a grid that has no name
  // Easting, northing and height of the map's origin, in metres.
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();
  double turn_rad = 0;  // of the map's x, counterclockwise from easting
  double scale = 1;     // metres of the grid to a metre of the map; heights are not scaled

  Eigen::Vector3d operator*(const Eigen::Vector3d& p_world) const {
    Eigen::Vector3d turned = Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()) * p_world;
    turned.head<2>() *= scale;
    return origin_m + turned;
  }
};

}  // namespace slcmap::data
