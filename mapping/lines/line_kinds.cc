#include "mapping/lines/line_kinds.h"

#include <algorithm>
#include <cmath>

namespace slcmap {
namespace {

// Grain, joints and print are as long as the boards and sheets that they are on; what is longer is
// of the building, unless it hardly stands out.
constexpr double kLong_m = 1.2, kMinLongStep = 0.15;

// Whether its step of brightness is large, or lasts and is not small.
bool StandsOut(const TrackedLine& line, double trim_step, bool lasts,
               const LineKindOptions& options) {
  const double brightness = std::max(line.brightness_sum, 1e-9);
  return (lasts && line.lasting_sum >= options.min_outline_step * brightness) ||
         line.step_sum >= trim_step * brightness;
}

}  // namespace

bool IsKnownBeside(const SurfacesBeside& beside, const LineKindOptions& options) {
  const double known_m = beside.flat_m + beside.relief_m;
  return known_m > options.min_known_share * (known_m + beside.unknown_m);
}

LineKind KindOf(const TrackedLine& line, const LineKindOptions& options) {
  const SurfacesBeside& beside = line.surfaces;
  const double known_m = beside.flat_m + beside.relief_m;
  const double all_m = known_m + beside.unknown_m;
  const double lasting = line.lasting_sum / std::max(line.step_sum, 1e-9);
  if (lasting > options.max_lasting_step) return LineKind::kMark;
  const bool lasts = lasting >= options.min_lasting_step;
  if (!IsKnownBeside(beside, options)) {
    return lasts ? LineKind::kUnknown : LineKind::kMark;
  }
  const bool is_in_texture = line.parallels >= options.texture_lines;
  if (is_in_texture && !StandsOut(line, options.min_trim_step, lasts, options)) {
    return LineKind::kMark;
  }
  if (beside.flat_m < options.min_flat_share * known_m) return LineKind::kEdge;
  const double trim_step = all_m >= kLong_m ? kMinLongStep : options.min_trim_step;
  return StandsOut(line, trim_step, lasts, options) ? LineKind::kOutline : LineKind::kMark;
}

}  // namespace slcmap
