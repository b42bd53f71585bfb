// Which right image belongs to which left one, by how both cameras' images move from each to the
// next.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "data/progress.h"
#include "data/source/sequence_source.h"

namespace slcmap {

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

}  // namespace slcmap
