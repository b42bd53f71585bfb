// How far the rows of the rectified cameras are apart, and the rotation and focal length that would
// mend it.
#pragma once

#include <vector>

#include "data/check/view_geometry.h"
#include "data/core/progress.h"
#include "data/source/sequence_source.h"

namespace slcmap::inline data {

struct RowAlignment {
  int matches = 0;            // features found in both images
  double agreeing_share = 0;  // of them, once mended
  double rows_px = 0;         // median distance from the row, as calibrated
  double turned_rows_px = 0;  // once the right camera is turned, with its focal length as it is
  double mended_rows_px = 0;  // once mended
  // The right camera's turn: R_imu_right is to be that of the calibration times Exp(turn_rad), in
  // the right camera's frame.
  Eigen::Vector3d turn_rad = Eigen::Vector3d::Zero();
  Eigen::Vector3d turn_sigma_rad = Eigen::Vector3d::Ones();
  // The right camera's focal length is to be longer by this share, against the left one's.
  double right_focal = 0;
  double right_focal_sigma = 1;
};

inline constexpr double kLongerFocal = 0.01;

// The rays of the right image's features, were its focal length longer by the share kLongerFocal;
// as many as matches.
std::vector<Eigen::Vector3d> LongerRays(const std::vector<RayPair>& matches, const Camera& right);

// What brings matches on their epipolar planes, found robustly and from coarse to fine: a turn, and
// with `longer` rays a focal length, 0 unless that is clear. About y (towards and away from each
// other) the turn is only seen in the corners of the images, and 0 unless that is clear. `focal_px`
// is that of both cameras, about.
RowAlignment AlignRows(const std::vector<RayPair>& matches, const RigidTransform& T_left_right,
                       double focal_px, const std::vector<Eigen::Vector3d>& longer = {});

// Features of the left images of `pairs` pairs, spread over the recording, that were found again in
// the right ones, to a fraction of a pixel; `rig` says where they are looked for.
std::vector<RayPair> MatchFinely(const SequenceSource& source, const Rig& rig, size_t pairs,
                                 const Progress& progress);

// Of one left image, in the right one of the pair so many later; none where there is no such pair.
std::vector<RayPair> MatchPair(const SequenceSource& source, const Rig& rig, size_t pair,
                               int later);

}  // namespace slcmap::data
