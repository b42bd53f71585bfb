#include "mapping/lines/line_kinds.h"

#include <algorithm>
#include <cmath>

namespace slcmap {

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
  if (beside.flat_m < options.min_flat_share * known_m) return LineKind::kEdge;
  const double step = line.lasting_sum / std::max(line.shown_samples, 1);
  return lasts && step >= options.min_outline_step ? LineKind::kOutline : LineKind::kMark;
}

}  // namespace slcmap
