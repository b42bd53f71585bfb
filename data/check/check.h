// Checks a recorded sequence before anyone spends time on it.
#pragma once

#include <string>

#include "data/check/report.h"
#include "data/sequence.h"

namespace slcmap {

// Opens a sequence and checks all of it: files, stamps, IMU, calibration, and a sample of its
// images. A sequence that cannot be opened gives a report with that one finding; nothing is thrown
// for bad data.
CheckReport CheckSequence(const std::string& path, const SequenceOptions& options = {});

// The parts, each of which adds figures and findings.
void CheckWarnings(const Warnings& warnings, CheckReport* report);  // what reading had to drop
void CheckStamps(const Sequence& sequence, CheckReport* report);    // counts, rates, gaps, cover
void CheckImu(const std::vector<ImuSample>& samples,
              CheckReport* report);  // values, units, gravity
void CheckCalibration(const Rig& rig, CheckReport* report);
void CheckImages(const Sequence& sequence, CheckReport* report);    // a sample of the pairs
void CheckRepeats(const Sequence& sequence, CheckReport* report);   // all images, by their files
void CheckGeometry(const Sequence& sequence, CheckReport* report);  // images against calibration

}  // namespace slcmap
