// A rig's recording in a bag, written as an EuRoC (ASL) folder.
#pragma once

#include <cstdint>
#include <string>

#include "data/bag/bag.h"
#include "data/bag/topics.h"
#include "data/core/progress.h"

namespace slcmap::inline data {

// What was written.
struct UnpackedCounts {
  int64_t left = 0, right = 0, imu = 0;
  Warnings warnings;  // what could not be used, and what the bag has lost
};

// Writes cam0, cam1 and imu0 into a folder: each image by the stamp of its header, as PNG, or as it
// was compressed; samples of gyroscope and accelerometer apart as rows that lack the other. Images
// in an encoding without grey or colour, such as H.264, are an InputFault. Throws OutputError, and
// StoppedError where progress ends it.
UnpackedCounts UnpackRecording(const RecordingTopics& topics, const std::string& folder,
                               const Progress& progress, Bag* bag);

}  // namespace slcmap::data
