#include "mapping/lines/line_kinds.h"

#include <algorithm>
#include <cmath>

namespace slcmap {
namespace {

// Grain, joints and print are as long as the boards and sheets that they are on; what is longer is
// of the building, unless it hardly stands out.
constexpr double kLong_m = 0.8, kMinLongStep = 0.15;

// Of the mean brightness: a step that lasts, or one that need not.
struct LeastSteps {
  double lasting = 0, beside = 0;
};

bool StandsOut(const TrackedLine& line, bool lasts, const LeastSteps& least) {
  const double brightness = std::max(line.brightness_sum, 1e-9);
  return (lasts && line.lasting_sum >= least.lasting * brightness) ||
         line.step_sum >= least.beside * brightness;
}

}  // namespace

LineKind KindOf(const TrackedLine& line, const LineKindOptions& options) {
  const SurfacesBeside& beside = line.surfaces;
  const double known_m = beside.flat_m + beside.relief_m;
  const double all_m = known_m + beside.unknown_m;
  const double lasting = line.lasting_sum / std::max(line.step_sum, 1e-9);
  if (lasting > options.max_lasting_step) return LineKind::kMark;
  const bool lasts = lasting >= options.min_lasting_step;
  if (known_m <= options.min_known_share * all_m) {
    return lasts ? LineKind::kUnknown : LineKind::kMark;
  }
  const bool is_in_texture = line.parallels >= options.texture_lines;
  const LeastSteps in_texture{options.min_textured_step, options.min_trim_step};
  if (is_in_texture && !StandsOut(line, lasts, in_texture)) return LineKind::kMark;
  if (beside.flat_m < options.min_flat_share * known_m) return LineKind::kEdge;
  const double beside_step = all_m >= kLong_m ? kMinLongStep : options.min_trim_step;
  const LeastSteps on_surface{options.min_outline_step, beside_step};
  return StandsOut(line, lasts, on_surface) ? LineKind::kOutline : LineKind::kMark;
}

}  // namespace slcmap
