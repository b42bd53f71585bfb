#include "mapping/given_poses/pose_options.h"

#include "data/option_table.h"

namespace slcmap {
namespace {

constexpr OptionTable kTable{
    Option{"adjust", &GivenPoseOptions::adjust, false, true},
    Option{"good_px", &GivenPoseOptions::good_px, 0.0, 100.0},
    Option{"body_sigma_m", &GivenPoseOptions::body_sigma_m, 1e-6, 10.0},
    Option{"body_sigma_rad", &GivenPoseOptions::body_sigma_rad, 1e-6, 1.0},
    Option{"clock_sigma_s", &GivenPoseOptions::clock_sigma_s, 1e-6, 10.0},
    Option{"sigma_m", &GivenPoseOptions::sigma_m, 1e-6, 10.0},
    Option{"sigma_rad", &GivenPoseOptions::sigma_rad, 1e-6, 1.0},
    Option{"point_sigma_px", &GivenPoseOptions::point_sigma_px, 0.01, 10.0},
    Option{"disparity_sigma_px", &GivenPoseOptions::disparity_sigma_px, 0.01, 10.0},
    Option{"robust_sigmas", &GivenPoseOptions::robust_sigmas, 0.1, 100.0},
    Option{"partners", &GivenPoseOptions::partners, 1, 100},
    Option{"max_travel_m", &GivenPoseOptions::max_travel_m, 0.01, 100.0},
    Option{"max_turn_rad", &GivenPoseOptions::max_turn_rad, 0.01, 3.0},
    Option{"rounds", &GivenPoseOptions::rounds, 1, 10},
    Option{"max_iterations", &GivenPoseOptions::max_iterations, 1, 1000}};

}  // namespace

void GivenPoseOptions::Check() const { kTable.Check("mapping.given_poses", *this); }

void GivenPoseOptions::Read(YamlSection section) {
  section.Skip("threads");  // as options.yaml of earlier maps has it
  kTable.Read(section, this);
}

}  // namespace slcmap
