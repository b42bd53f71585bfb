// A rig's recording in a bag: which topics it is, and how it is written as an EuRoC (ASL) folder.
#pragma once

#include <cstdint>
#include <string>

#include "data/bag/bag.h"
#include "data/core/progress.h"

namespace slcmap::inline data {

// Names of topics.
struct RecordingTopics {
  std::string left, right;  // "" of the right where there is one camera
  std::string gyro, accel;  // the same where one topic has both
};

// The topics that `said` leaves out: the one pair of image topics whose names differ by left and
// right or by a number, else the one image topic; the one IMU topic, else those of a gyroscope and
// an accelerometer. Compressed images are taken where the same are not there otherwise. Throws
// ConfigError for a topic in `said` that is not there or of another type, and InputFault, with what
// is there and what to say, where none or several could be it.
RecordingTopics ChooseTopics(const Bag& bag, const RecordingTopics& said);

// Of the text left=/a,right=/b,imu=/c, or gyro= and accel= instead of imu=, any of them left out.
// Throws ConfigError.
RecordingTopics ParseTopics(const std::string& text);

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
