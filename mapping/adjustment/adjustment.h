// One visual-inertial adjustment over all keyframes of a run, where that can be done, and the run
// as mapping takes it.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "data/core/progress.h"
#include "mapping/adjustment/closure.h"
#include "mapping/adjustment/options.h"
#include "mapping/map/map.h"
#include "mapping/views/view.h"
#include "odometry/run/run.h"

namespace slcmap::inline mapping {

struct AdjustedRun {
  OdometryRun run;  // states are the online ones
  // None where it was not adjusted: all is then as the run has it, and `reason` says why.
  std::optional<AdjustmentFigures> figures = {};
  std::string reason = {};
};

// Where closures come from: what is recognised once a run is adjusted without any.
using ClosureSource =
    std::function<std::vector<Closure>(const AdjustmentState& state, const Progress& progress)>;

// Poses, velocities and biases of all keyframes, all points that several keyframes saw, all lines
// with the headings they share, and the calibration, from all that the run observed at once. The
// first pose of each segment keeps its position and heading. The same run gives the same result,
// to the last bit. With the images of the keyframes (in their order; null for none) places are
// recognised by points too, else by edges alone. Control points and known distances
// pull what they bind. Throws StoppedError when progress says so, and ConfigError.
AdjustedRun Adjust(const OdometryRun& run, const AdjustmentOptions& options,
                   const ViewImages* images = nullptr, const Progress& progress = {},
                   const ControlTies& control = {});

// The same with closures from elsewhere, right or wrong; none looks for no revisits.
AdjustedRun AdjustWithClosures(const OdometryRun& run, const AdjustmentOptions& options,
                               const ClosureSource& find, const Progress& progress = {},
                               const ControlTies& control = {});

// Counts runs that have too little to be adjusted, as a warning of the run.
inline constexpr const char* kNotAdjusted = "not_adjusted";

// The run as it is where adjusting it is not enabled, where its poses were given, where it visits
// no place again (needs_revisit), where it has too little to adjust (which is counted), and where
// progress ends that. With the images of its keyframes (null for none), read as they are needed,
// places are recognised by points too where that is enabled. Throws ConfigError.
AdjustedRun AdjustRun(OdometryRun run, const AdjustmentOptions& options, const ViewImages* images,
                      const Progress& progress = {}, const ControlTies& control = {});

}  // namespace slcmap::mapping
