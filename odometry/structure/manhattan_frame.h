// The three directions of a building in a single image, with no pose and no other images.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "odometry/frontend/line_observation.h"

namespace slcmap {

struct ManhattanFrameOptions {
  double end_sigma_px = 0.5;  // of a segment's ends, across it
  double min_length_px = 25;
  double max_angle_rad = 0.035;      // between a segment and the ray to its vanishing point
  double max_prior_angle_rad = 0.1;  // between the vertical and its prior
  double prior_sigma_rad = 0.01;     // of the prior
  int max_trials = 2000;
  int min_segments = 12;        // that follow the directions
  int min_segments_second = 4;  // that follow the axis with the second most of them
  double min_share = 0.4;       // of the length of all segments, that follow
};

struct ManhattanFrame {
  // Columns: X, Y, vertical (pointing up: against the camera's y, or along the prior). X is the
  // horizontal one nearest to the direction in which the camera looks, and points ahead.
  Eigen::Matrix3d R_camera_manhattan = Eigen::Matrix3d::Identity();
  double explained_share = 0;  // of the length of all segments long enough
  std::vector<int> axes;       // for each segment 0, 1, 2; -1: follows none, or is too short
};

// Clusters segments (on the plane z = 1 of a camera of the given focal length) by three vanishing
// points at right angles: RANSAC over triples of them, then least squares over a rotation, which
// keeps the three exactly orthogonal (SLC-VIO, section 3.3). Without a prior the vertical is the
// axis nearest to the camera's y. up_camera: the vertical in the camera, where it is known. The
// same input gives the same result. Nothing where too few segments agree.
std::optional<ManhattanFrame> DetectManhattanFrame(
    const std::vector<LineSegment>& segments, double focal_px,
    const std::optional<Eigen::Vector3d>& up_camera = std::nullopt,
    const ManhattanFrameOptions& options = {});

}  // namespace slcmap
