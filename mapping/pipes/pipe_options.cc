#include "mapping/pipes/pipe_options.h"

#include "data/option_table.h"

namespace slcmap {
namespace {

constexpr OptionTable kTable{
    Option{"find", &PipeOptions::find, false, true},
    Option{"min_radius_m", &PipeOptions::min_radius_m, 0.005, 10.0},
    Option{"min_outlined_radius_m", &PipeOptions::min_outlined_radius_m, 0.005, 10.0},
    Option{"max_radius_m", &PipeOptions::max_radius_m, 0.005, 10.0},
    Option{"min_length_m", &PipeOptions::min_length_m, 0.1, 100.0},
    Option{"sigma_px", &PipeOptions::sigma_px, 0.01, 10.0},
    Option{"pose_sigma_m", &PipeOptions::pose_sigma_m, 0.0, 1.0},
    Option{"max_turn_rad", &PipeOptions::max_turn_rad, 0.0, 0.5},
    Option{"max_off_sigmas", &PipeOptions::max_off_sigmas, 0.1, 100.0},
    Option{"min_touching", &PipeOptions::min_touching, 0.1, 1.0},
    Option{"min_both_sides", &PipeOptions::min_both_sides, 0.0, 1.0},
    Option{"min_gain", &PipeOptions::min_gain, 1.0, 100.0},
    Option{"max_surface_off", &PipeOptions::max_surface_off, 0.0, 1.0},
    Option{"max_outlined_off_m", &PipeOptions::max_outlined_off_m, 0.0, 1.0}};

}  // namespace

void PipeOptions::Check() const {
  kTable.Check("mapping.pipes", *this);
  if (max_radius_m < min_radius_m) {
    throw ConfigError("mapping.pipes.max_radius_m: expected at least min_radius_m");
  }
}

void PipeOptions::Read(YamlSection section) { kTable.Read(section, this); }

}  // namespace slcmap
