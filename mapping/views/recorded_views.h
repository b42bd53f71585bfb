// Views of a recording: the keyframes of a run, or what poses by anyone say.
#pragma once

#include <memory>
#include <string>

#include "data/trajectory.h"
#include "mapping/views/view.h"
#include "odometry/run.h"

namespace slcmap {

struct RecordedViews {
  Views views;
  std::unique_ptr<ViewImages> images;
};

// The keyframes of a run with their images, in the recording's folder or, where that has moved to
// another one, in `sequence` (not empty). Images are rectified with what the run found of the
// cameras' calibration. Throws DataError when the run does not say where its images are, is of one
// camera, or when none of the files is there; keyframes without files are views without images.
RecordedViews ViewsOfRun(const OdometryRun& run, const std::string& sequence);

// Which images of a recording become views when poses are given.
struct ViewSelection {
  double min_travel_m = 0.1;          // from the view before, or
  double min_turn_rad = 0.15;         // as much as that
  double max_pose_gap_s = 0.1;        // between poses that one is interpolated from
  double max_stamp_offset_s = 0.005;  // to a pose that is taken as it is
};

// The images of a recording (an ASL folder; IMU data are not needed) at which a trajectory has
// poses. `calibration` as SequenceOptions has it. Throws DataError when the recording cannot be
// used, or no pose covers an image.
RecordedViews ViewsAtPoses(const std::string& sequence, const std::string& calibration,
                           const Trajectory& trajectory, const ViewSelection& selection);

}  // namespace slcmap
