// Whether a run can be believed, by what it knows about itself.
#pragma once

#include "odometry/run.h"
#include "odometry/verdict/verdict_options.h"

namespace slcmap {

// Pure: of the run's figures, states, warnings and source. Of a run without figures, as one of an
// earlier version, what the states say.
Verdict JudgeRun(const OdometryRun& run, const VerdictOptions& options);

}  // namespace slcmap
