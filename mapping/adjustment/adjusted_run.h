// A run as mapping takes it: adjusted over all its keyframes where that can be done.
#pragma once

#include <optional>

#include "data/progress.h"
#include "mapping/adjustment/adjustment.h"
#include "odometry/run.h"

namespace slcmap {

struct AdjustedRun {
  OdometryRun run;                           // states are the online ones
  std::optional<AdjustmentFigures> figures;  // none where it was not adjusted
};

// Counts runs that have too little to be adjusted, as a warning of the run.
inline constexpr const char* kNotAdjusted = "not_adjusted";

// The run as it is where adjusting it is not enabled, where its poses were given, where it visits
// no place again (needs_revisit), where it has too little to adjust (which is counted), and where
// progress ends that. With the images of its keyframes (null for none), read as they are needed,
// places are recognised by points too where that is enabled. Throws ConfigError.
AdjustedRun AdjustRun(OdometryRun run, const AdjustmentOptions& options, const ViewImages* images,
                      const Progress& progress = {});

}  // namespace slcmap
