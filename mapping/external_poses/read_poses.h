// Poses by others for a recording: read, and judged by its images and its accelerometer.
#pragma once

#include <optional>
#include <string>

#include "data/core/progress.h"
#include "data/io/pose_file.h"
#include "data/source/sequence.h"
#include "mapping/external_poses/pose_reading.h"
#include "mapping/map/map.h"

namespace slcmap::inline mapping {

struct ExternalPoses {
  Trajectory trajectory;  // of the IMU, z up; near the origin of its world
  Eigen::Vector3d world_offset_m = Eigen::Vector3d::Zero();  // added to it, where they were given
  PoseReading reading;
};

// Throws DataError that says what is wrong, by which figures, and which option takes the poses as
// they are, where the images or the accelerometer tell that they are not as `form` says; and what
// ReadPoseTable throws. Poses that no reading explains are refused if `refuses_unexplained`, else
// left to the caller.
ExternalPoses ReadExternalPoses(const std::string& path, const PoseForm& form,
                                const Sequence& recording, bool refuses_unexplained,
                                const Progress& progress = {});

// Where up is in the world of poses, by the accelerometer: the mean of its readings there, less
// what the poses say that the rig accelerated. None where few poses have a sample, or samples are
// no m/s^2.
std::optional<Eigen::Vector3d> UpByForce(const Sequence& recording, const Trajectory& trajectory);

// What is wrong with how far an adjustment moved poses, by how far single pairs of images have
// them off; "" where nothing is, or that is not known and infinite.
std::string TooFarMoved(const ExternalPoseFigures& figures, double off_by_pairs_rad,
                        double off_by_pairs_m);

}  // namespace slcmap::mapping
