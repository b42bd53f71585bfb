#include "mapping/lines/options.h"

#include <algorithm>
#include <string>

#include "data/core/error.h"
#include "data/io/yaml.h"

namespace slcmap::inline mapping {
namespace {

constexpr OptionTable kTable{
    Option{"min_segment_px", &MapLineOptions::min_segment_px, 10.0, 1e4},
    Option{"max_segments", &MapLineOptions::max_segments, 1, 100000},
    Option{"min_gradient", &MapLineOptions::min_gradient, 0.1, 255.0},
    Option{"min_gradient_share", &MapLineOptions::min_gradient_share, 0.0, 1.0},
    Option{"axis_distance_px", &MapLineOptions::axis_distance_px, 0.1, 20.0},
    Option{"explained_px", &MapLineOptions::explained_px, 0.1, 20.0},
    Option{"max_depth_m", &MapLineOptions::max_depth_m, 0.5, 1000.0},
    Option{"max_found_sigma_m", &MapLineOptions::max_found_sigma_m, 1e-4, 10.0},
    Option{"max_sigma_m", &MapLineOptions::max_sigma_m, 1e-4, 10.0},
    Option{"max_spread_px", &MapLineOptions::max_spread_px, 0.01, 10.0},
    Option{"max_free_spread_px", &MapLineOptions::max_free_spread_px, 0.01, 10.0},
    Option{"min_views", &MapLineOptions::min_views, 2, 1000},
    Option{"min_axis_sigma_rad", &MapLineOptions::min_axis_sigma_rad, 1e-6, 1.0},
    Option{"level_sigma_rad", &MapLineOptions::level_sigma_rad, 1e-6, 1.0}};

constexpr OptionTable kViewsTable{
    Option{"between_keyframes", &ViewSpacingOptions::between_keyframes, false, true},
    Option{"min_travel_m", &ViewSpacingOptions::min_travel_m, 0.01, 100.0},
    Option{"min_turn_rad", &ViewSpacingOptions::min_turn_rad, 0.01, 3.0},
    Option{"max_alike", &ViewSpacingOptions::max_alike, 1, 1000000},
    Option{"alike_m", &ViewSpacingOptions::alike_m, 0.0, 100.0},
    Option{"alike_rad", &ViewSpacingOptions::alike_rad, 0.0, 3.2}};

constexpr OptionTable kSweepTable{
    Option{"min_depth_m", &LineSweepOptions::min_depth_m, 0.01, 1000.0},
    Option{"max_depth_m", &LineSweepOptions::max_depth_m, 0.5, 1000.0},
    Option{"step_px", &LineSweepOptions::step_px, 0.1, 10.0},
    Option{"min_baseline_m", &LineSweepOptions::min_baseline_m, 0.001, 100.0},
    Option{"max_baseline_m", &LineSweepOptions::max_baseline_m, 0.01, 100.0},
    Option{"max_turn_rad", &LineSweepOptions::max_turn_rad, 0.01, 3.0},
    Option{"min_parallax_m", &LineSweepOptions::min_parallax_m, 0.001, 100.0},
    Option{"max_views", &LineSweepOptions::max_views, 1, 100},
    Option{"min_share", &LineSweepOptions::min_share, 0.1, 1.0},
    Option{"min_images", &LineSweepOptions::min_images, 2, 100},
    Option{"min_lead", &LineSweepOptions::min_lead, 0.0, 1.0}};

constexpr OptionTable kFitTable{
    Option{"place_step_m", &LineFitOptions::place_step_m, 0.01, 10.0},
    Option{"sigma_px", &LineFitOptions::sigma_px, 0.01, 10.0},
    Option{"far_power", &LineFitOptions::far_power, 0.0, 10.0},
    Option{"most_times_farther", &LineFitOptions::most_times_farther, 1.0, 1000.0},
    Option{"stretch_m", &LineFitOptions::stretch_m, 0.01, 100.0},
    Option{"pose_sigma_m", &LineFitOptions::pose_sigma_m, 0.0, 1.0},
    Option{"robust_sigmas", &LineFitOptions::robust_sigmas, 0.5, 100.0},
    Option{"views_that_count", &LineFitOptions::views_that_count, 1, 10000},
    Option{"shared_sigma_m", &LineFitOptions::shared_sigma_m, 0.0, 1.0}};

constexpr OptionTable kNeighbourTable{
    Option{"building_share", &NeighbourOptions::building_share, 0.0, 1.0},
    Option{"shared_share", &NeighbourOptions::shared_share, 0.0, 1.0},
    Option{"reach_m", &NeighbourOptions::reach_m, 0.01, 1000.0},
    Option{"max_neighbours", &NeighbourOptions::max_neighbours, 0, 200}};

constexpr OptionTable kIntervalTable{
    Option{"bin_m", &LineIntervalOptions::bin_m, 0.005, 1.0},
    Option{"max_gap_m", &LineIntervalOptions::max_gap_m, 0.0, 10.0},
    Option{"min_length_m", &LineIntervalOptions::min_length_m, 0.0, 10.0},
    Option{"min_views", &LineIntervalOptions::min_views, 1, 1000},
    Option{"min_share", &LineIntervalOptions::min_share, 0.0, 1.0}};

constexpr OptionTable kMergingTable{
    Option{"max_sigmas", &LineMergingOptions::max_sigmas, 0.0, 100.0},
    Option{"max_distance_m", &LineMergingOptions::max_distance_m, 0.0, 1.0},
    Option{"min_distance_m", &LineMergingOptions::min_distance_m, 0.0, 1.0}};

constexpr OptionTable kKindTable{
    Option{"min_lasting_step", &LineKindOptions::min_lasting_step, -100.0, 100.0},
    Option{"max_lasting_step", &LineKindOptions::max_lasting_step, -100.0, 100.0},
    Option{"min_outline_step", &LineKindOptions::min_outline_step, 0.0, 2.0},
    Option{"min_trim_step", &LineKindOptions::min_trim_step, 0.0, 2.0},
    Option{"min_textured_step", &LineKindOptions::min_textured_step, 0.0, 2.0},
    Option{"texture_lines", &LineKindOptions::texture_lines, 1, 1000},
    Option{"texture_reach_m", &LineKindOptions::texture_reach_m, 0.0, 0.5},
    Option{"min_known_share", &LineKindOptions::min_known_share, 0.0, 1.0},
    Option{"min_flat_share", &LineKindOptions::min_flat_share, 0.0, 1.0}};

}  // namespace

void MapLineOptions::Check() const {
  kTable.Check("mapping.lines", *this);
  kViewsTable.Check("mapping.lines.views", views);
  kSweepTable.Check("mapping.lines.sweep", sweep);
  kFitTable.Check("mapping.lines.fit", fit);
  kNeighbourTable.Check("mapping.lines.neighbours", neighbours);
  if (neighbours.building_share + neighbours.shared_share > 1) {
    throw ConfigError("mapping.lines.neighbours.shared_share: found " +
                      std::to_string(neighbours.shared_share) +
                      ", expected at most what building_share leaves of 1");
  }
  kIntervalTable.Check("mapping.lines.intervals", intervals);
  kMergingTable.Check("mapping.lines.merging", merging);
  kKindTable.Check("mapping.lines.kinds", kinds);
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
  kViewsTable.Read(section.Section("views"), &views);
  kSweepTable.Read(section.Section("sweep"), &sweep);
  kFitTable.Read(section.Section("fit"), &fit);
  kNeighbourTable.Read(section.Section("neighbours"), &neighbours);
  kIntervalTable.Read(section.Section("intervals"), &intervals);
  kMergingTable.Read(section.Section("merging"), &merging);
  kKindTable.Read(section.Section("kinds"), &kinds);
  for (const char* key : {"min_parallax_rad", "min_ghost_share"}) section.Retire(key);
  kTable.Read(section, this);
}

}  // namespace slcmap::mapping
