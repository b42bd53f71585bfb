// The integral of a gyroscope's readings; which right image belongs to which left one, by how both
// cameras' images move; and what images show of the rig or of its carrier.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "data/core/progress.h"
#include "data/core/types.h"
#include "data/source/sequence_source.h"

namespace slcmap::inline data {

// Readings are interpolated linearly; absurd ones are left out. Over the time between two images
// the integral is the rotation vector, but for the little that comes of an axis that turns.
class GyroIntegral {
 public:
  explicit GyroIntegral(const std::vector<ImuSample>& imu);

  bool Covers(int64_t from_ns, int64_t to_ns) const;
  Eigen::Vector3d Between(int64_t from_ns, int64_t to_ns) const;  // rad, within what is covered
  Eigen::Vector3d RateAt(int64_t stamp_ns) const;                 // rad/s

 private:
  size_t Before(int64_t stamp_ns) const;
  Eigen::Vector3d Until(int64_t stamp_ns) const;

  std::vector<int64_t> stamps_ns_;
  std::vector<Eigen::Vector3d> rates_, integrals_;
};

// How far what is seen moves from each image to the next, in radians along the left camera's x and
// y; nothing where it could not be followed. One less than there are pairs.
using ImageSteps = std::vector<std::optional<Eigen::Vector2d>>;

ImageSteps FollowSteps(const SequenceSource& source, int camera, const Progress& progress);

// The same as a gyroscope has it for the left camera, of images at those stamps.
ImageSteps StepsOfGyro(const std::vector<int64_t>& stamps_ns, const Rig& rig,
                       const std::vector<ImuSample>& imu);

// For each left step, how many later the right one is that is the same: pieces with one lag each,
// as many as the steps insist on (the least sum of squares, cut off, and a price for each change).
// `noise_rad` is that of a step.
std::vector<int> FindLags(const ImageSteps& left, const ImageSteps& right, double noise_rad);

// By how many images those of a piece, [first, end) of the left steps, are later than their stamps
// by the gyroscope's steps; 0 unless another is clearly better.
int LateBy(const ImageSteps& left, const ImageSteps& gyro, size_t first, size_t end);

// Masks (data/calibration/mask.h) of what stays where it is in the images while the rig turns, one
// a camera; empty where there is nothing of this kind, or the rig turns too little to tell. Images
// that were taken far apart in time and by the gyroscope look in other directions: where they show
// the same texture at the same place all the same, that is not the building. Throws StoppedError
// where progress ends it.
std::vector<cv::Mat> FindCarried(const SequenceSource& source,
                                 const std::vector<ImuSample>& samples, const Progress& progress);

}  // namespace slcmap::data
