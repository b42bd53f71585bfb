// Coordinate reference systems that surveyors use, by their EPSG code, as PROJ knows them.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>

namespace slcmap::inline data {

// A place in a projected system.
struct PlaceOnEarth {
  double latitude_deg = 0, longitude_deg = 0;
  // Metres of the grid to a metre of the ground at that height: the projection's scale, and that
  // from the height down to the ellipsoid.
  double scale = 1;
  // Of true north from the grid's, counterclockwise: less than 0 to the west of the middle of a
  // zone north of the equator. Surveyors call its negative, or it, the convergence.
  double true_north_rad = 0;
};

// A system with eastings and northings in metres; the order of its axes is always easting,
// northing. Not for several threads at once.
class CoordinateSystem {
 public:
  // "EPSG:25832", or with a system of heights "EPSG:25832+7837". Throws ConfigError where PROJ does
  // not know it, or where its coordinates are no metres of a plane: then naming the system of the
  // zone that `latitude_longitude_deg` is in, where that is given.
  explicit CoordinateSystem(
      const std::string& name,
      const std::optional<Eigen::Vector2d>& latitude_longitude_deg = std::nullopt);
  ~CoordinateSystem();

  const std::string& name() const { return name_; }
  const std::string& title() const { return title_; }  // "ETRS89 / UTM zone 32N"

  // As OGC WKT of version 1, which files of all ages hold.
  std::string Wkt() const;

  // Degrees of WGS 84, with which PROJ has all other systems agree at least to a metre or two;
  // nothing where it cannot compute them.
  std::optional<Eigen::Vector2d> LongitudeLatitude_deg(const Eigen::Vector2d& p_m) const;

  // Nothing beyond the area that the system is for.
  std::optional<PlaceOnEarth> At(const Eigen::Vector3d& easting_northing_height_m) const;

 private:
  struct Handles;

  void RequireMetres(const std::optional<Eigen::Vector2d>& latitude_longitude_deg) const;

  const std::string name_;
  std::string title_;
  std::unique_ptr<Handles> handles_;
};

// The UTM zone of a place: that of ETRS89 in Europe, else that of WGS 84.
std::string UtmSystemAt(double latitude_deg, double longitude_deg);

}  // namespace slcmap::data
