#include "odometry/structure/options.h"

#include "data/io/yaml.h"

namespace slcmap::inline odometry {

constexpr OptionTable kManhattan{
    Option{"min_length_px", &ManhattanOptions::min_length_px, 1.0, 10000.0},
    Option{"min_images", &ManhattanOptions::min_images, 1, 10000},
    Option{"min_images_below", &ManhattanOptions::min_images_below, 1, 10000},
    Option{"min_mean_length_px", &ManhattanOptions::min_mean_length_px, 0.0, 1000000.0},
    Option{"min_share", &ManhattanOptions::min_share, 0.0, 1.0},
    Option{"min_minor_share", &ManhattanOptions::min_minor_share, 0.0, 0.5}};

void ManhattanOptions::Check() const { kManhattan.Check("manhattan", *this); }
void ManhattanOptions::Read(YamlSection section) {
  kManhattan.Read(
      section, this,
      {"tilt_sigma_rad", "full_weight_px", "min_vertical_sigmas", "max_vote_sigma_rad",
       "memory_images", "search_step_rad", "search_sigma_rad", "max_sigmas", "min_separation_rad",
       "runner_up_separation_rad", "min_image_share", "min_overhead_share", "max_runner_up",
       "min_one_axis_share", "min_spread", "min_images_one_axis", "max_runner_up_one_axis",
       "min_given_up", "max_given_up_share"});
}

constexpr OptionTable kLineClassifier{
    Option{"end_sigma_px", &LineClassifierOptions::end_sigma_px, 0.01, 20.0},
    Option{"direction_sigma_rad", &LineClassifierOptions::direction_sigma_rad, 1e-06, 0.2}};

void LineClassifierOptions::Check() const { kLineClassifier.Check("line_classifier", *this); }
void LineClassifierOptions::Read(YamlSection section) {
  kLineClassifier.Read(section, this, {"max_sigmas", "max_angle_rad", "min_other_sigmas"});
}

constexpr OptionTable kSlopes{Option{"enabled", &SlopeOptions::enabled, false, true},
                              Option{"min_lines", &SlopeOptions::min_lines, 2, 10000}};

void SlopeOptions::Check() const { kSlopes.Check("slopes", *this); }
void SlopeOptions::Read(YamlSection section) {
  kSlopes.Read(
      section, this,
      {"min_length_m", "max_line_sigma_rad", "min_separation_rad", "min_other_sigmas",
       "memory_keyframes", "search_sigma_rad", "max_sigmas", "max_angle_rad", "min_objects",
       "min_apart_m", "max_sigma_rad", "min_given_up", "max_given_up_share"});
}

constexpr OptionTable kPointsOnLines{
    Option{"min_keyframes", &PointsOnLinesOptions::min_keyframes, 1, 1000}};

void PointsOnLinesOptions::Check() const { kPointsOnLines.Check("points_on_lines", *this); }
void PointsOnLinesOptions::Read(YamlSection section) {
  kPointsOnLines.Read(section, this,
                      {"max_distance_px", "min_apart_px", "max_beyond_px", "min_crossing_rad",
                       "max_unseen_keyframes", "area_px"});
}

constexpr OptionTable kBuildingDeviation{
    Option{"start_sigma_rad", &BuildingDeviationOptions::start_sigma_rad, 0.0, 0.1},
    Option{"min_sigma_rad", &BuildingDeviationOptions::min_sigma_rad, 1e-5, 0.1},
    Option{"max_sigma_rad", &BuildingDeviationOptions::max_sigma_rad, 1e-5, 0.1},
    Option{"exact_below_rad", &BuildingDeviationOptions::exact_below_rad, 0.0, 0.1},
    Option{"shared_share", &BuildingDeviationOptions::shared_share, 0.0, 0.95},
    Option{"max_piece_m", &BuildingDeviationOptions::max_piece_m, 0.1, 1e6},
    Option{"max_sigmas", &BuildingDeviationOptions::max_sigmas, 1.0, 1e6}};

void BuildingDeviationOptions::Check() const {
  kBuildingDeviation.Check("building_deviation", *this);
  CheckOrder("building_deviation", "min_sigma_rad", min_sigma_rad, "max_sigma_rad", max_sigma_rad);
  if (start_sigma_rad == 0) return;
  CheckOrder("building_deviation", "min_sigma_rad", min_sigma_rad, "start_sigma_rad",
             start_sigma_rad);
  CheckOrder("building_deviation", "start_sigma_rad", start_sigma_rad, "max_sigma_rad",
             max_sigma_rad);
}
void BuildingDeviationOptions::Read(YamlSection section) {
  kBuildingDeviation.Read(section, this,
                          {"start_lines", "probe_every", "shared_radius_m", "loss_sigma"});
}

}  // namespace slcmap::odometry
