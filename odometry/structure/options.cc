#include "odometry/structure/options.h"

#include "data/io/yaml.h"

namespace slcmap::inline odometry {

constexpr OptionTable kManhattan{
    Option{"tilt_sigma_rad", &ManhattanOptions::tilt_sigma_rad, 1e-06, 0.2},
    Option{"min_length_px", &ManhattanOptions::min_length_px, 1.0, 10000.0},
    Option{"full_weight_px", &ManhattanOptions::full_weight_px, 1.0, 10000.0},
    Option{"min_vertical_sigmas", &ManhattanOptions::min_vertical_sigmas, 0.0, 100.0},
    Option{"max_vote_sigma_rad", &ManhattanOptions::max_vote_sigma_rad, 0.0001, 0.5},
    Option{"memory_images", &ManhattanOptions::memory_images, 1, 10000},
    Option{"search_step_rad", &ManhattanOptions::search_step_rad, 0.0001, 0.1},
    Option{"search_sigma_rad", &ManhattanOptions::search_sigma_rad, 1e-05, 0.1},
    Option{"max_sigmas", &ManhattanOptions::max_sigmas, 0.5, 10.0},
    Option{"min_separation_rad", &ManhattanOptions::min_separation_rad, 0.01, 0.7},
    Option{"runner_up_separation_rad", &ManhattanOptions::runner_up_separation_rad, 0.01, 0.7},
    Option{"min_images", &ManhattanOptions::min_images, 1, 10000},
    Option{"min_images_below", &ManhattanOptions::min_images_below, 1, 10000},
    Option{"min_image_share", &ManhattanOptions::min_image_share, 0.0, 1.0},
    Option{"min_mean_length_px", &ManhattanOptions::min_mean_length_px, 0.0, 1000000.0},
    Option{"min_overhead_share", &ManhattanOptions::min_overhead_share, 0.0, 1.0},
    Option{"max_runner_up", &ManhattanOptions::max_runner_up, 0.0, 1.0},
    Option{"min_share", &ManhattanOptions::min_share, 0.0, 1.0},
    Option{"min_minor_share", &ManhattanOptions::min_minor_share, 0.0, 0.5},
    Option{"min_one_axis_share", &ManhattanOptions::min_one_axis_share, 0.0, 1.0},
    Option{"min_spread", &ManhattanOptions::min_spread, 0.0, 1.0},
    Option{"min_images_one_axis", &ManhattanOptions::min_images_one_axis, 1, 10000},
    Option{"max_runner_up_one_axis", &ManhattanOptions::max_runner_up_one_axis, 0.0, 1.0},
    Option{"min_given_up", &ManhattanOptions::min_given_up, 1, 1000000},
    Option{"max_given_up_share", &ManhattanOptions::max_given_up_share, 0.0, 1.0}};

void ManhattanOptions::Check() const { kManhattan.Check("manhattan", *this); }
void ManhattanOptions::Read(YamlSection section) { kManhattan.Read(section, this); }

constexpr OptionTable kLineClassifier{
    Option{"end_sigma_px", &LineClassifierOptions::end_sigma_px, 0.01, 20.0},
    Option{"direction_sigma_rad", &LineClassifierOptions::direction_sigma_rad, 1e-06, 0.2},
    Option{"max_sigmas", &LineClassifierOptions::max_sigmas, 0.5, 100.0},
    Option{"max_angle_rad", &LineClassifierOptions::max_angle_rad, 0.001, 0.5},
    Option{"min_other_sigmas", &LineClassifierOptions::min_other_sigmas, 0.5, 100.0}};

void LineClassifierOptions::Check() const { kLineClassifier.Check("line_classifier", *this); }
void LineClassifierOptions::Read(YamlSection section) { kLineClassifier.Read(section, this); }

constexpr OptionTable kSlopes{
    Option{"enabled", &SlopeOptions::enabled, false, true},
    Option{"min_length_m", &SlopeOptions::min_length_m, 0.0, 100.0},
    Option{"max_line_sigma_rad", &SlopeOptions::max_line_sigma_rad, 1e-4, 0.2},
    Option{"min_separation_rad", &SlopeOptions::min_separation_rad, 0.01, 0.7},
    Option{"min_other_sigmas", &SlopeOptions::min_other_sigmas, 0.5, 100.0},
    Option{"memory_keyframes", &SlopeOptions::memory_keyframes, 1, 10000},
    Option{"search_sigma_rad", &SlopeOptions::search_sigma_rad, 1e-5, 0.1},
    Option{"max_sigmas", &SlopeOptions::max_sigmas, 0.5, 10.0},
    Option{"max_angle_rad", &SlopeOptions::max_angle_rad, 1e-3, 0.5},
    Option{"min_lines", &SlopeOptions::min_lines, 2, 10000},
    Option{"min_objects", &SlopeOptions::min_objects, 1, 10000},
    Option{"min_apart_m", &SlopeOptions::min_apart_m, 0.0, 100.0},
    Option{"max_sigma_rad", &SlopeOptions::max_sigma_rad, 1e-4, 0.2},
    Option{"min_given_up", &SlopeOptions::min_given_up, 1, 1000000},
    Option{"max_given_up_share", &SlopeOptions::max_given_up_share, 0.0, 1.0}};

void SlopeOptions::Check() const { kSlopes.Check("slopes", *this); }
void SlopeOptions::Read(YamlSection section) { kSlopes.Read(section, this); }

constexpr OptionTable kPointsOnLines{
    Option{"max_distance_px", &PointsOnLinesOptions::max_distance_px, 0.01, 100.0},
    Option{"min_apart_px", &PointsOnLinesOptions::min_apart_px, 0.01, 100.0},
    Option{"max_beyond_px", &PointsOnLinesOptions::max_beyond_px, 0.0, 1000.0},
    Option{"min_crossing_rad", &PointsOnLinesOptions::min_crossing_rad, 0.0, 1.5},
    Option{"min_keyframes", &PointsOnLinesOptions::min_keyframes, 1, 1000},
    Option{"max_unseen_keyframes", &PointsOnLinesOptions::max_unseen_keyframes, 1, 100000},
    Option{"area_px", &PointsOnLinesOptions::area_px, 4.0, 1000.0}};

void PointsOnLinesOptions::Check() const { kPointsOnLines.Check("points_on_lines", *this); }
void PointsOnLinesOptions::Read(YamlSection section) { kPointsOnLines.Read(section, this); }

constexpr OptionTable kBuildingDeviation{
    Option{"start_sigma_rad", &BuildingDeviationOptions::start_sigma_rad, 0.0, 0.1},
    Option{"start_lines", &BuildingDeviationOptions::start_lines, 0.01, 1e9},
    Option{"min_sigma_rad", &BuildingDeviationOptions::min_sigma_rad, 1e-5, 0.1},
    Option{"max_sigma_rad", &BuildingDeviationOptions::max_sigma_rad, 1e-5, 0.1},
    Option{"exact_below_rad", &BuildingDeviationOptions::exact_below_rad, 0.0, 0.1},
    Option{"shared_share", &BuildingDeviationOptions::shared_share, 0.0, 0.95},
    Option{"max_piece_m", &BuildingDeviationOptions::max_piece_m, 0.1, 1e6},
    Option{"shared_radius_m", &BuildingDeviationOptions::shared_radius_m, 0.1, 1000.0},
    Option{"probe_every", &BuildingDeviationOptions::probe_every, 1, 1000000},
    Option{"loss_sigma", &BuildingDeviationOptions::loss_sigma, 0.1, 100.0},
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
void BuildingDeviationOptions::Read(YamlSection section) { kBuildingDeviation.Read(section, this); }

}  // namespace slcmap::odometry
