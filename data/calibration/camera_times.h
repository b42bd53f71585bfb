// When the images of calibrated cameras are exposed: by how much their stamps are shifted against
// the IMU's and each other's, and how long a rolling shutter takes.
#pragma once

#include <vector>

#include "data/calibration/camera_words.h"
#include "data/core/error.h"
#include "data/core/types.h"
#include "data/io/yaml.h"

namespace slcmap::inline data {

// Between the images of a pair: what is further apart in time is taken for a mistake.
inline constexpr double kMaxRightOffset_s = 0.03;
inline constexpr double kMinRightOffset_s = 1e-3;  // less is how stamps and calibrations scatter

// Of a camera, in ASL's and in Kalibr's form: Rig::readout_s.
inline constexpr const char* kReadoutKey = "readout_s";

// Of a camera; 0 where it is not said. Throws InputFault for one that cannot be.
double ReadReadout(YamlSection& camera);

// What a camera's section says of its times. Throws InputFault for a readout that cannot be.
void ReadTimes(YamlSection* section, ChainCamera* camera);

// The times of a rig of the cameras that are used. A camera without a shift has that of the rig:
// none, or that of the left one. Throws InputFault where shifts are too far apart.
void TakeTimes(const std::vector<const ChainCamera*>& used, Rig* rig, Warnings* warnings);

}  // namespace slcmap::data
