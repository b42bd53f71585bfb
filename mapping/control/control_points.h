// What a surveyor gives: control points, where they were clicked in images, and known distances.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace slcmap::inline mapping {

// A point whose coordinates somebody measured: easting, northing and height, in metres.
struct ControlPoint {
  std::string name;  // of a tag "tag36h11:5", or "5" of the family that its recording shows
  Eigen::Vector3d p_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma_m = Eigen::Vector3d::Zero();
};

// A point in an image as it was recorded.
struct Sighting {
  std::string name;
  int64_t stamp_ns = 0;  // of the map, on the camera's clock
  int camera = 0;        // 0 left, 1 right
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
  double sigma_px = 1;
};

struct KnownDistance {
  std::string from, to;
  double metres = 0, sigma_m = 0.003;  // as of a tape or a laser
};

struct Control {
  std::string path = {};  // of the points, for messages; "" where only distances were given
  std::vector<ControlPoint> points = {};
  std::vector<KnownDistance> distances = {};
  std::string crs = {};  // "EPSG:25832"; "" of a grid without a name
  std::vector<Sighting> sightings = {};
};

// A table with a header row: name; easting, northing, height (or e, n, h, or x, y, z); and perhaps
// sigma_m, or one for each axis (sigma_easting_m ...); else 10 mm. Throws DataError naming file,
// row and column: also for latitudes and longitudes, names that come twice, and a table of less
// than one point.
std::vector<ControlPoint> ReadControlPoints(const std::string& path);

// A table with a header row: name, stamp_ns, camera, x_px, y_px. Throws DataError as above.
std::vector<Sighting> ReadMarks(const std::string& path);

// "NAME1,NAME2,METRES", and perhaps ",SIGMA_M". Throws ConfigError.
KnownDistance ParseDistance(const std::string& text);

// The names of all points that are asked for, once each, in their order.
std::vector<std::string> ListNames(const Control& control);

}  // namespace slcmap::mapping
