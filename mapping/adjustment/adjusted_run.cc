#include "mapping/adjustment/adjusted_run.h"

#include <spdlog/spdlog.h>

#include "data/error.h"
#include "odometry/method.h"

namespace slcmap {

namespace {

bool HasRevisit(const AdjustmentFigures& figures) {
  return figures.closures > figures.closures_taken_back;
}

}  // namespace

AdjustedRun AdjustRun(OdometryRun run, const AdjustmentOptions& options, const ViewImages* images,
                      const Progress& progress) {
  AdjustedRun adjusted{std::move(run), std::nullopt};
  // Without closures no place is known to be seen again.
  const bool is_wanted = options.enabled && (options.closures.enabled || !options.needs_revisit);
  if (!is_wanted || adjusted.run.method == kGivenPoses || adjusted.run.keyframes.empty()) {
    return adjusted;
  }
  try {
    const AdjustmentResult result = Adjust(adjusted.run, options, images, progress);
    if (result.usable && options.needs_revisit && !HasRevisit(result.figures)) return adjusted;
    if (result.usable) {
      Apply(result, &adjusted.run);
      adjusted.figures = result.figures;
    } else {
      ++adjusted.run.warnings[kNotAdjusted];
      spdlog::debug("keyframes are not adjusted: {}", result.reason);
    }
  } catch (const StoppedError&) {
    spdlog::debug("the adjustment was interrupted");
  }
  return adjusted;
}

}  // namespace slcmap
