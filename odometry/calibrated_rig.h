// A rig with what a run has found of its calibration.
#pragma once

#include "odometry/run.h"

namespace slcmap {

// `given` as the run was given it, raw, with its rectified form; the estimate's corrections are
// those of calibration.h.
Rig CalibratedRig(const Rig& given, const Rig& rectified, const CalibrationEstimate& estimate);

}  // namespace slcmap
