// Transforms that lay an estimated trajectory over the truth.
#pragma once

#include <Eigen/Core>
#include <string>

#include "data/rigid_transform.h"

namespace slcmap {

// What an alignment may change. A visual-inertial estimator observes all but position and yaw, so
// kPositionYaw is the fair one; kRigid is what most other tools do; kSimilarity also scales, which
// is for methods that cannot know the scale.
enum class AlignmentKind { kPositionYaw, kRigid, kSimilarity };

std::string AlignmentName(AlignmentKind kind);  // "posyaw", "se3", "sim3"

// p_truth = scale * rotation * p_estimate + translation.
struct Alignment {
  double scale = 1;
  RigidTransform T_truth_estimate;

  Eigen::Vector3d Position(const Eigen::Vector3d& p_estimate) const {
    return T_truth_estimate.rotation * (scale * p_estimate) + T_truth_estimate.translation;
  }
};

// The alignment of least squares between the columns of two equally large matrices (metres). kRigid
// and kSimilarity follow S. Umeyama, "Least-squares estimation of transformation parameters between
// two point patterns", PAMI 1991; the yaw of kPositionYaw has a closed form. Positions that do not
// determine the rotation (less than three, or all on a line) get some rotation of least squares.
Alignment Align(AlignmentKind kind, const Eigen::Matrix3Xd& estimate,
                const Eigen::Matrix3Xd& truth);

}  // namespace slcmap
