#include "mapping/lines/options.h"

#include <algorithm>

#include "data/io/yaml.h"

namespace slcmap::inline mapping {
namespace {

constexpr OptionTable kTable{
    Option{"min_segment_px", &MapLineOptions::min_segment_px, 10.0, 1e4},
    Option{"max_depth_m", &MapLineOptions::max_depth_m, 0.5, 1000.0},
    Option{"max_sigma_m", &MapLineOptions::max_sigma_m, 1e-4, 10.0},
    Option{"max_spread_px", &MapLineOptions::max_spread_px, 0.01, 10.0},
    Option{"max_free_spread_px", &MapLineOptions::max_free_spread_px, 0.01, 10.0},
    Option{"min_views", &MapLineOptions::min_views, 2, 1000},
    Option{"min_axis_sigma_rad", &MapLineOptions::min_axis_sigma_rad, 1e-6, 1.0}};

constexpr OptionTable kViewsTable{
    Option{"between_keyframes", &ViewSpacingOptions::between_keyframes, false, true},
    Option{"min_travel_m", &ViewSpacingOptions::min_travel_m, 0.01, 100.0},
    Option{"min_turn_rad", &ViewSpacingOptions::min_turn_rad, 0.01, 3.0},
    Option{"max_alike", &ViewSpacingOptions::max_alike, 1, 1000000}};

constexpr OptionTable kSweepTable{
    Option{"max_depth_m", &LineSweepOptions::max_depth_m, 0.5, 1000.0}};

constexpr OptionTable kFitTable{
    Option{"sigma_px", &LineFitOptions::sigma_px, 0.01, 10.0},
    Option{"far_power", &LineFitOptions::far_power, 0.0, 10.0},
    Option{"most_times_farther", &LineFitOptions::most_times_farther, 1.0, 1000.0},
    Option{"stretch_m", &LineFitOptions::stretch_m, 0.01, 100.0},
    Option{"pose_sigma_m", &LineFitOptions::pose_sigma_m, 0.0, 1.0},
    Option{"views_that_count", &LineFitOptions::views_that_count, 1, 10000},
    Option{"shared_sigma_m", &LineFitOptions::shared_sigma_m, 0.0, 1.0}};

}  // namespace

void MapLineOptions::Check() const {
  kTable.Check("mapping.lines", *this);
  kViewsTable.Check("mapping.lines.views", views);
  kSweepTable.Check("mapping.lines.sweep", sweep);
  kFitTable.Check("mapping.lines.fit", fit);
}

MapLineOptions MapLineOptions::ForPoses(double across_px) const {
  constexpr double kUsual_px = 0.15, kMost = 5;
  const double factor = std::clamp(across_px / kUsual_px, 1.0, kMost);
  MapLineOptions options = *this;
  options.max_spread_px *= factor;
  options.max_free_spread_px *= factor;
  options.fit.sigma_px *= factor;
  options.fit.pose_sigma_m *= factor;
  options.fit.shared_sigma_m *= factor;
  return options;
}

void MapLineOptions::Read(YamlSection section) {
  kViewsTable.Read(section.Section("views"), &views, {"alike_m", "alike_rad"});
  kSweepTable.Read(section.Section("sweep"), &sweep,
                   {"min_depth_m", "step_px", "min_baseline_m", "max_baseline_m", "max_turn_rad",
                    "min_parallax_m", "max_views", "min_share", "min_images", "min_lead"});
  kFitTable.Read(section.Section("fit"), &fit, {"place_step_m", "robust_sigmas"});
  kTable.Read(section, this,
              {"intervals", "merging", "kinds", "neighbours", "min_parallax_rad", "min_ghost_share",
               "max_segments", "min_gradient", "min_gradient_share", "axis_distance_px",
               "explained_px", "max_found_sigma_m", "level_sigma_rad"});
}

}  // namespace slcmap::mapping
