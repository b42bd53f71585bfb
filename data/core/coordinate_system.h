// Where the frame of a map lies on Earth, or in the grid of a surveyor; coordinate reference
// systems that surveyors use, by their EPSG code, as PROJ knows them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <optional>
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

  // As PROJ's lists have it: "EPSG:25832", or with that of heights "EPSG:25832+7837"; as it was
  // given where they do not have it.
  const std::string& name() const { return name_; }
  const std::string& title() const { return title_; }  // "ETRS89 / UTM zone 32N"

  // The system of heights, "" where none was given.
  const std::string& title_of_heights() const { return title_of_heights_; }

  // As OGC WKT of version 1, which files of all ages hold.
  std::string Wkt() const;
  std::string WktOfPlane() const;  // without heights

  // Degrees of WGS 84, with which PROJ has all other systems agree at least to a metre or two;
  // nothing where it cannot compute them.
  std::optional<Eigen::Vector2d> LongitudeLatitude_deg(const Eigen::Vector2d& p_m) const;

  // Nothing beyond the area that the system is for.
  std::optional<PlaceOnEarth> At(const Eigen::Vector3d& easting_northing_height_m) const;

 private:
  struct Handles;

  void NameAfterLists();
  void RequireMetres(const std::optional<Eigen::Vector2d>& latitude_longitude_deg) const;

  std::string name_, title_, title_of_heights_;
  std::unique_ptr<Handles> handles_;
};

// As CoordinateSystem::name() has it; a system that is not known stays as it is called.
std::string NameOfSystem(const std::string& crs);

// The UTM zone of a place: that of ETRS89 in Europe, else that of WGS 84.
std::string UtmSystemAt(double latitude_deg, double longitude_deg);

}  // namespace slcmap::data
