#include "mapping/adjustment/options.h"

#include "data/io/yaml.h"

namespace slcmap::inline mapping {
namespace {

constexpr double kMaxSigma_px = 100;

constexpr OptionTable kTable{
    Option{"enabled", &AdjustmentOptions::enabled, false, true},
    Option{"needs_revisit", &AdjustmentOptions::needs_revisit, false, true},
    Option{"point_sigma_px", &AdjustmentOptions::point_sigma_px, 1e-3, kMaxSigma_px},
    Option{"line_sigma_px", &AdjustmentOptions::line_sigma_px, 1e-3, kMaxSigma_px},
    Option{"exact_below_rad", &AdjustmentOptions::exact_below_rad, 0.0, 0.1},
    Option{"deviation_scale", &AdjustmentOptions::deviation_scale, 0.1, 100.0},
    Option{"min_scatter", &AdjustmentOptions::min_scatter, 0.01, 1.0},
    Option{"max_scatter", &AdjustmentOptions::max_scatter, 1.0, 100.0},
    Option{"max_iterations", &AdjustmentOptions::max_iterations, 1, 1000}};

constexpr OptionTable kClosures{
    Option{"enabled", &ClosureOptions::enabled, false, true},
    Option{"points", &ClosureOptions::points, false, true},
    Option{"min_path_m", &ClosureOptions::min_path_m, 0.0, 1e4},
    Option{"min_interval_s", &ClosureOptions::min_interval_s, 0.0, 1e4},
    Option{"gate_m", &ClosureOptions::gate_m, 1e-4, 100.0},
    Option{"min_edges", &ClosureOptions::min_edges, 3, 1000},
    Option{"min_points", &ClosureOptions::min_points, 4, 1000},
    Option{"point_tolerance_px", &ClosureOptions::point_tolerance_px, 0.1, 100.0},
    Option{"max_point_closures", &ClosureOptions::max_point_closures, 1, 100000},
    Option{"point_sigma_px", &ClosureOptions::point_sigma_px, 1e-2, 100.0},
    Option{"loss_sigma", &ClosureOptions::loss_sigma, 0.1, 100.0}};

}  // namespace

void ClosureOptions::Check() const { kClosures.Check("mapping.adjustment.closures", *this); }
void ClosureOptions::Read(YamlSection section) {
  kClosures.Read(section, this,
                 {"gate_per_m", "gate_rad", "gate_rad_per_m", "min_lead", "min_displacement_m",
                  "edge_tolerance_m", "min_correlation", "min_keyframes", "edge_sigma_m",
                  "min_agreeing", "max_link_chi2"});
}

void AdjustmentOptions::Check() const {
  kTable.Check("mapping.adjustment", *this);
  calibration.Check();
  closures.Check();
}

void AdjustmentOptions::Read(YamlSection section) {
  calibration.Read(section.Section("calibration"));
  closures.Read(section.Section("closures"));
  kTable.Read(section, this,
              {"point_loss_sigma", "line_loss_sigma", "max_point_chi2", "max_line_chi2",
               "min_point_keyframes", "line_observations", "max_eliminated_observations",
               "shared_share", "shared_radius_m", "axis_loss_sigma"});
}

}  // namespace slcmap::mapping
