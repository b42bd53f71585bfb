#include "data/core/coordinate_system.h"

#include <proj.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "data/core/error.h"
#include "data/core/math.h"

namespace slcmap::inline data {
namespace {

constexpr double kEarthRadius_m = 6371000;
constexpr double kBesideArea_deg = 3;  // systems are used a little beyond their area, too

struct Destroy {
  void operator()(PJ* object) const { proj_destroy(object); }
};
using Object = std::unique_ptr<PJ, Destroy>;

}  // namespace

struct CoordinateSystem::Handles {
  Handles() : context(proj_context_create()) { proj_log_level(context, PJ_LOG_NONE); }
  ~Handles() {
    to_wgs84.reset();
    whole.reset();
    to_degrees.reset();
    system.reset();
    proj_context_destroy(context);
  }
  Handles(const Handles&) = delete;
  Handles& operator=(const Handles&) = delete;

  // From the system to another, with east first in both.
  Object To(const Object& other) const {
    const Object as_defined(
        proj_create_crs_to_crs_from_pj(context, system.get(), other.get(), nullptr, nullptr));
    return Object(proj_normalize_for_visualization(context, as_defined.get()));
  }

  // Of easting and northing: longitude and latitude.
  std::optional<Eigen::Vector2d> ToDegrees(const Object& transform,
                                           const Eigen::Vector2d& p_m) const {
    const PJ_COORD at = proj_trans(transform.get(), PJ_FWD, proj_coord(p_m.x(), p_m.y(), 0, 0));
    if (!std::isfinite(at.xy.x) || !std::isfinite(at.xy.y)) return std::nullopt;
    return Eigen::Vector2d(at.xy.x, at.xy.y);
  }

  Eigen::Vector2d FromDegrees(double longitude_deg, double latitude_deg) const {
    const PJ_COORD at =
        proj_trans(to_degrees.get(), PJ_INV, proj_coord(longitude_deg, latitude_deg, 0, 0));
    return {at.xy.x, at.xy.y};
  }

  bool IsFor(const Eigen::Vector2d& longitude_latitude) const {
    double west = 0, south = 0, east = 0, north = 0;
    if (!proj_get_area_of_use(context, system.get(), &west, &south, &east, &north, nullptr)) {
      return true;  // nobody says
    }
    const double x = longitude_latitude.x(), y = longitude_latitude.y();
    const bool is_between = west > east || (x >= west - kBesideArea_deg &&
                                            x <= east + kBesideArea_deg);  // or over 180 degrees
    return is_between && y >= south - kBesideArea_deg && y <= north + kBesideArea_deg;
  }

  // Square metres of the ellipsoid to a rad of longitude by a rad of latitude.
  double GroundAt(double latitude_rad) const {
    const Object ellipsoid(proj_get_ellipsoid(context, system.get()));
    double a_m = 0, b_m = 0;
    proj_ellipsoid_get_parameters(context, ellipsoid.get(), &a_m, &b_m, nullptr, nullptr);
    const double e2 = 1 - b_m * b_m / (a_m * a_m), sine = std::sin(latitude_rad);
    const double w2 = 1 - e2 * sine * sine;  // radii of curvature: a (1 - e2) / w^3 and a / w
    return a_m * a_m * (1 - e2) * std::cos(latitude_rad) / (w2 * w2);
  }

  std::string Wkt(const Object& of) const {
    const char* const text = proj_as_wkt(context, of.get(), PJ_WKT1_GDAL, nullptr);
    return text == nullptr ? "" : text;
  }

  PJ_CONTEXT* context;
  Object whole, system, to_degrees, to_wgs84;  // `system` is that of the plane
};

namespace {

// "EPSG:25832"; "" of a system that no list has.
std::string NameInLists(const Object& system) {
  const char* const authority = proj_get_id_auth_name(system.get(), 0);
  const char* const code = proj_get_id_code(system.get(), 0);
  return authority && code ? fmt::format("{}:{}", authority, code) : "";
}

}  // namespace

CoordinateSystem::CoordinateSystem(const std::string& name,
                                   const std::optional<Eigen::Vector2d>& latitude_longitude_deg)
    : name_(name), handles_(std::make_unique<Handles>()) {
  PJ_CONTEXT* context = handles_->context;
  handles_->system.reset(proj_create(context, name.c_str()));
  if (!handles_->system || !proj_is_crs(handles_->system.get())) {
    throw ConfigError(fmt::format(
        "crs: found '{}', which PROJ does not know, expected such as EPSG:25832", name));
  }
  handles_->whole.reset(proj_clone(context, handles_->system.get()));
  if (proj_get_type(handles_->whole.get()) == PJ_TYPE_COMPOUND_CRS) {
    handles_->system.reset(proj_crs_get_sub_crs(context, handles_->whole.get(), 0));
  }
  title_ = proj_get_name(handles_->system.get());
  NameAfterLists();
  RequireMetres(latitude_longitude_deg);
  const Object degrees(proj_crs_get_geodetic_crs(context, handles_->system.get()));
  handles_->to_degrees = handles_->To(degrees);
  handles_->to_wgs84 = handles_->To(Object(proj_create(context, "EPSG:4326")));
  if (!handles_->to_degrees || !handles_->to_wgs84) {
    throw ConfigError(fmt::format("crs: found {}, which PROJ cannot compute with", name));
  }
}

CoordinateSystem::~CoordinateSystem() = default;

void CoordinateSystem::RequireMetres(
    const std::optional<Eigen::Vector2d>& latitude_longitude_deg) const {
  const Eigen::Vector2d place = latitude_longitude_deg.value_or(Eigen::Vector2d(51, 9));
  const std::string remedy = fmt::format(
      "give coordinates in one of them, {} {}, as cs2cs of PROJ computes them",
      latitude_longitude_deg ? "at that place" : "such as", UtmSystemAt(place.x(), place.y()));
  if (proj_get_type(handles_->system.get()) != PJ_TYPE_PROJECTED_CRS) {
    throw ConfigError(fmt::format(
        "crs: found {} ({}), which has degrees or another unit, expected one with eastings and "
        "northings in metres: {}",
        name_, title_, remedy));
  }
  const Object axes(proj_crs_get_coordinate_system(handles_->context, handles_->system.get()));
  double metres = 1;
  const char* unit = "";
  proj_cs_get_axis_info(handles_->context, axes.get(), 0, nullptr, nullptr, nullptr, &metres, &unit,
                        nullptr, nullptr);
  if (metres == 1) return;
  throw ConfigError(fmt::format("crs: found {} ({}) in the unit {}, expected one in metres: {}",
                                name_, title_, unit, remedy));
}

std::string NameOfSystem(const std::string& crs) {
  try {
    return crs.empty() ? crs : CoordinateSystem(crs).name();
  } catch (const ConfigError&) {
    return crs;
  }
}

void CoordinateSystem::NameAfterLists() {
  const std::string plane = NameInLists(handles_->system);
  if (plane.empty()) return;
  const Object heights(proj_crs_get_sub_crs(handles_->context, handles_->whole.get(), 1));
  if (!heights) {
    name_ = plane;
    return;
  }
  title_of_heights_ = proj_get_name(heights.get());
  const std::string of_heights = NameInLists(heights);
  if (of_heights.empty()) return;
  const std::string list = plane.substr(0, plane.find(':') + 1);
  name_ =
      plane + "+" + (of_heights.starts_with(list) ? of_heights.substr(list.size()) : of_heights);
}

std::string CoordinateSystem::Wkt() const { return handles_->Wkt(handles_->whole); }
std::string CoordinateSystem::WktOfPlane() const { return handles_->Wkt(handles_->system); }

std::optional<Eigen::Vector2d> CoordinateSystem::LongitudeLatitude_deg(
    const Eigen::Vector2d& p_m) const {
  return handles_->ToDegrees(handles_->to_wgs84, p_m);
}

std::optional<PlaceOnEarth> CoordinateSystem::At(const Eigen::Vector3d& p_m) const {
  constexpr double kStep_deg = 1e-4;  // some 10 m
  const auto at = handles_->ToDegrees(handles_->to_degrees, p_m.head<2>());
  if (!at || !handles_->IsFor(*at)) return std::nullopt;
  PlaceOnEarth place{at->y(), at->x()};
  const auto step_along = [&](double east_deg, double north_deg) -> Eigen::Vector2d {
    return (handles_->FromDegrees(at->x() + east_deg, at->y() + north_deg) -
            handles_->FromDegrees(at->x() - east_deg, at->y() - north_deg)) /
           (2 * kStep_deg * kDegree);
  };
  const Eigen::Vector2d east = step_along(kStep_deg, 0), north = step_along(0, kStep_deg);
  const double grid_m2 = east.x() * north.y() - east.y() * north.x();
  const double projected = std::sqrt(grid_m2 / handles_->GroundAt(place.latitude_deg * kDegree));
  if (!(projected > 0)) return std::nullopt;
  place.scale = projected * kEarthRadius_m / (kEarthRadius_m + p_m.z());
  place.true_north_rad = std::atan2(-north.x(), north.y());
  return place;
}

std::string UtmSystemAt(double latitude_deg, double longitude_deg) {
  const int zone = std::clamp(static_cast<int>(std::floor((longitude_deg + 180) / 6)) + 1, 1, 60);
  const bool is_european = latitude_deg > 34 && zone >= 28 && zone <= 38;
  if (is_european) return fmt::format("EPSG:258{:02d}", zone);
  return fmt::format("EPSG:32{}{:02d}", latitude_deg < 0 ? 7 : 6, zone);
}

}  // namespace slcmap::data
