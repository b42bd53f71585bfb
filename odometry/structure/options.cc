#include "odometry/structure/options.h"

#include <spdlog/fmt/fmt.h>

#include "data/io/yaml.h"

namespace slcmap::inline odometry {

constexpr OptionTable kSlopes{Option{"enabled", &SlopeOptions::enabled, false, true}};

void SlopeOptions::Check() const { kSlopes.Check("slopes", *this); }
void SlopeOptions::Read(YamlSection section) {
  kSlopes.Read(
      section, this,
      {"min_length_m", "max_line_sigma_rad", "min_separation_rad", "min_other_sigmas",
       "memory_keyframes", "search_sigma_rad", "max_sigmas", "max_angle_rad", "min_objects",
       "min_lines", "min_apart_m", "max_sigma_rad", "min_given_up", "max_given_up_share"});
}

constexpr OptionTable kBuildingDeviation{
    Option{"start_sigma_rad", &BuildingDeviationOptions::start_sigma_rad, 0.0, 0.1}};

void BuildingDeviationOptions::Check() const {
  kBuildingDeviation.Check("building_deviation", *this);
  if (start_sigma_rad == 0 ||
      (start_sigma_rad >= min_sigma_rad && start_sigma_rad <= max_sigma_rad)) {
    return;
  }
  throw ConfigError(
      fmt::format("building_deviation.start_sigma_rad: found {}, expected 0, or {} to {}",
                  start_sigma_rad, min_sigma_rad, max_sigma_rad));
}
void BuildingDeviationOptions::Read(YamlSection section) {
  kBuildingDeviation.Read(
      section, this,
      {"start_lines", "probe_every", "shared_radius_m", "loss_sigma", "min_sigma_rad",
       "max_sigma_rad", "exact_below_rad", "shared_share", "max_piece_m", "max_sigmas"});
}

}  // namespace slcmap::odometry
