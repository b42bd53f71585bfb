// Checks a recorded sequence before anyone spends time on it.
#pragma once

#include <string>

#include "data/check/report.h"
#include "data/core/progress.h"
#include "data/source/sequence.h"
#include "data/source/sequence_source.h"

namespace slcmap::inline data {

struct TurnAlignment;

// Opens a sequence and checks all of it: files, stamps, IMU, calibration, the header and length of
// every image, and the pixels of a sample of them. A sequence that cannot be opened gives a report
// with that one finding; nothing is thrown for bad data. Throws StoppedError where progress ends
// it.
CheckReport CheckSequence(const std::string& path, const SequenceOptions& options = {},
                          const Progress& progress = {});

// The same for a sequence that is open; takes its IMU samples, but no pairs.
CheckReport CheckSource(SequenceSource* source, const Progress& progress = {});

// The part that odometry needs before it starts, of a few seconds: IMU, calibration and geometry.
CheckReport CheckStart(SequenceSource* source, const std::vector<ImuSample>& samples,
                       const Progress& progress = {});

// Turns that differ by a factor: the gyroscope's about all axes, the focal lengths' about x and y.
// One camera takes shifts for turns where it sees little: factors that differ between x and y are
// then no error. False where that is so, and nothing else is to be judged by these turns.
bool JudgeScales(const TurnAlignment& turns, const Rig& rig, CheckReport* report);

// Adds to the finding that a rotation of the calibration is mirrored which axes are wrong, where
// the images' turns tell.
void CheckMirrored(const std::string& path, SequenceOptions options, const Progress& progress,
                   CheckFinding* finding);

// The parts, each of which adds figures and findings. `samples` are the source's.
void CheckImu(const std::vector<ImuSample>& samples,
              CheckReport* report);                          // values, units, gravity
void CheckCalibration(const Rig& rig, CheckReport* report);  // figures
// Whether a rig of two cameras can be one with the left camera on the left.
void CheckStereoRig(const Rig& rig, CheckReport* report);
// The header and the length of each `step`-th image; an error where most of one camera, or of the
// pairs, cannot be used.
void CheckFiles(const SequenceSource& source, size_t step, const Progress& progress,
                CheckReport* report);
void CheckImages(const SequenceSource& source, const Progress& progress, CheckReport* report);
void CheckRepeats(const SequenceSource& source, const Progress& progress, CheckReport* report);
// What moves with the rig: from then on the source and what follows leave it out.
void CheckCarried(SequenceSource* source, const std::vector<ImuSample>& samples,
                  const Progress& progress, CheckReport* report);
// Left images against right ones; adds a correction where the right camera is turned a little.
void CheckStereo(const SequenceSource& source, const Progress& progress, CheckReport* report);
// Images against gyroscope and accelerometer, with the rig as it is after the corrections; adds one
// where the time offset is another.
void CheckMotion(const SequenceSource& source, const Rig& rig,
                 const std::vector<ImuSample>& samples, const Progress& progress,
                 CheckReport* report);
// Whether a gap of the images or of the samples alone is a clock that was set forward: by how
// images turn against the gyroscope before and behind it.
void CheckClock(const SequenceSource& source, const Rig& rig, const std::vector<ImuSample>& samples,
                const Progress& progress, CheckReport* report);
// All of these.
void CheckGeometry(const SequenceSource& source, const std::vector<ImuSample>& samples,
                   const Progress& progress, CheckReport* report);

// {first, later, late} of each piece: from this pair on, the right images are those of the pair so
// many later, and the left ones were taken so many later than their stamps say.
inline constexpr const char* kRightShiftCorrection = "right_images_shifted";
// {first, end}: the pairs that are used.
inline constexpr const char* kStretchCorrection = "pairs_used";

// Compares rows at pairs spread over a recording. Where they agree in one part and not in another,
// and the right images of other pairs move as the left ones do, those are paired anew, with stamps
// that fit the gyroscope; where a turn of a camera explains it, the other part goes on with the
// left images only, or is left out if those do not fit the gyroscope. Both are a finding and a
// correction. Nothing is done, nor said, where neither explains it.
void MendIntervals(Sequence* sequence, const Progress& progress, CheckReport* report);

// Without the images that have lost their right one.
Sequence SelectPairs(Sequence sequence);

}  // namespace slcmap::data
