#include "mapping/given_poses/other_axes.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace slcmap {
namespace {

// Right-handed and left-handed axes along others.
std::vector<Eigen::Matrix3d> AxesAlongOthers() {
  std::vector<Eigen::Matrix3d> all;
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
      for (int i = 0; i < 3; ++i) axes(order[i], i) = (signs >> i) % 2 == 0 ? 1 : -1;
      all.push_back(axes);
    }
  } while (std::ranges::next_permutation(order).found);
  return all;
}

std::string AxesInWords(const Eigen::Matrix3d& axes) {
  std::vector<std::string> names;
  for (int i = 0; i < 3; ++i) {
    Eigen::Index along = 0;
    axes.col(i).cwiseAbs().maxCoeff(&along);
    names.push_back(fmt::format("{}{}", axes(along, i) < 0 ? "-" : "", "xyz"[along]));
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

// The steps in a frame of other axes, which may be left-handed.
std::vector<BodyStep> StepsInAxes(std::vector<BodyStep> steps, const Eigen::Matrix3d& axes) {
  for (BodyStep& step : steps) {
    const RigidTransform& T = step.T_from_to;
    const Eigen::Matrix3d R = axes.transpose() * T.rotation.toRotationMatrix() * axes;
    step.T_from_to = {Eigen::Quaterniond(R), axes.transpose() * T.translation};
  }
  return steps;
}

PoseOff OffIn(const Trajectory& poses, const std::vector<BodyStep>& steps, const PoseForm& given) {
  const std::vector<StepPair> pairs = PairsAt(poses, steps, std::llround(given.offset_s * 1e9));
  double sigma = 0;
  const double scale = ScaleOf(pairs, &sigma);
  return OffOf(pairs, std::isfinite(sigma) && scale > 0 ? scale : given.scale);
}

Trajectory WithPositionsIn(const Eigen::Matrix3d& axes, Trajectory poses) {
  for (StampedPose& pose : poses) {
    pose.T_world_imu.translation = axes.transpose() * pose.T_world_imu.translation;
  }
  return poses;
}

}  // namespace

std::string WordsOfOtherAxes(const std::vector<PosesToTry>& readings, const PoseForm& given,
                             const PoseOff& otherwise) {
  constexpr double kMuchBetter = 0.5, kFits = 1.5;  // standard deviations
  double least = std::min(kFits, kMuchBetter * otherwise.cost);
  std::string words;
  const auto compare = [&](const PoseOff& off, const std::string& of_it) {
    if (off.cost >= least || off.steps < kLeastSteps || 2 * off.steps < otherwise.steps) return;
    least = off.cost;
    words = of_it;
  };
  for (const PosesToTry& reading : readings) {
    for (const Eigen::Matrix3d& axes : AxesAlongOthers()) {
      const bool is_mirrored = axes.determinant() < 0;
      compare(OffIn(reading.poses, StepsInAxes(reading.steps, axes), given),
              fmt::format("{} (axes x, y, z that are {} of the {})",
                          is_mirrored ? "the poses are mirrored, in left-handed axes"
                                      : "the poses are those of a body that is turned",
                          AxesInWords(axes), reading.sensor));
      if (!is_mirrored) continue;
      compare(OffIn(WithPositionsIn(axes, reading.poses), reading.steps, given),
              fmt::format("the positions are mirrored, in left-handed axes (x, y, z are {} of the "
                          "world that the rotations are in)",
                          AxesInWords(axes.transpose())));
    }
  }
  return words;
}

}  // namespace slcmap
