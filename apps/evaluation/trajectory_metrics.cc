#include "apps/evaluation/trajectory_metrics.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "apps/evaluation/report.h"
#include "data/core/error.h"
#include "data/core/math.h"

namespace slcmap::inline evaluation {
namespace {

constexpr double kInitialisation_s = 1;  // of a sequence; what may go without a pose
constexpr double kMinCoverage = 0.99;    // after initialisation; below it, a result is flagged
constexpr double kMaxLoopGap = 0.05;     // of the path: the truth ends this near to its start

// Minimises sum |truth - Rz(yaw) estimate - t|^2: with both sets centred, the sum falls with
// cos(yaw) * sum(xe xt + ye yt) + sin(yaw) * sum(xe yt - ye xt).
Alignment AlignPositionYaw(const Eigen::Matrix3Xd& estimate, const Eigen::Matrix3Xd& truth) {
  const Eigen::Vector3d mean_estimate = estimate.rowwise().mean(),
                        mean_truth = truth.rowwise().mean();
  const Eigen::Matrix3Xd e = estimate.colwise() - mean_estimate, t = truth.colwise() - mean_truth;
  const double along = e.row(0).dot(t.row(0)) + e.row(1).dot(t.row(1));
  const double across = e.row(0).dot(t.row(1)) - e.row(1).dot(t.row(0));
  const Eigen::Quaterniond rotation(
      Eigen::AngleAxisd(std::atan2(across, along), Eigen::Vector3d::UnitZ()));
  return {1, {rotation, mean_truth - rotation * mean_estimate}};
}

Alignment AlignUmeyama(const Eigen::Matrix3Xd& estimate, const Eigen::Matrix3Xd& truth,
                       bool with_scale) {
  // Without any extent there is no scale to find.
  with_scale = with_scale && (estimate.colwise() - estimate.col(0)).norm() > 1e-9;
  const Eigen::Matrix4d matrix = Eigen::umeyama(estimate, truth, with_scale);
  const double scale = with_scale ? std::cbrt(matrix.topLeftCorner<3, 3>().determinant()) : 1;
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>() / scale;
  return {scale, {Eigen::Quaterniond(rotation).normalized(), matrix.topRightCorner<3, 1>()}};
}

}  // namespace

std::string AlignmentName(AlignmentKind kind) {
  switch (kind) {
    case AlignmentKind::kPositionYaw:
      return "posyaw";
    case AlignmentKind::kRigid:
      return "se3";
    case AlignmentKind::kSimilarity:
      break;
  }
  return "sim3";
}

Alignment Align(AlignmentKind kind, const Eigen::Matrix3Xd& estimate,
                const Eigen::Matrix3Xd& truth) {
  if (kind == AlignmentKind::kPositionYaw) return AlignPositionYaw(estimate, truth);
  return AlignUmeyama(estimate, truth, kind == AlignmentKind::kSimilarity);
}

namespace {

constexpr double kMaxGapFrames = 3;
constexpr double kMinExtent_m = 0.01;
// A pose stands for the stamps around it; a little more than half a frame, as stamps jitter.
constexpr double kCoveredFrames = 0.6;

double RootMeanSquare(const std::vector<double>& values) {
  const double sum = std::inner_product(values.begin(), values.end(), values.begin(), 0.0);
  return std::sqrt(sum / static_cast<double>(values.size()));
}

double ComputeMiddle(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return (*middle + *std::max_element(values.begin(), middle)) / 2;
}

double AngleDeg(const Eigen::Quaterniond& rotation) {
  return LogRotation(rotation).norm() * kDegreesPerRadian;
}

std::vector<AssociatedPose> Associate(const Trajectory& truth, const Trajectory& estimate,
                                      double max_gap_s) {
  std::vector<AssociatedPose> poses;
  for (const StampedPose& pose : estimate) {
    const auto T_world_truth = PoseAt(truth, pose.stamp_ns, max_gap_s);
    if (T_world_truth) poses.push_back({pose.stamp_ns, pose.T_world_imu, *T_world_truth});
  }
  return poses;
}

// The median time between poses; 0 for a single one.
int64_t FramePeriod(const Trajectory& estimate) {
  std::vector<double> periods;
  for (std::size_t i = 1; i < estimate.size(); ++i) {
    periods.push_back(static_cast<double>(estimate[i].stamp_ns - estimate[i - 1].stamp_ns));
  }
  return periods.empty() ? 0 : static_cast<int64_t>(ComputeMiddle(periods));
}

int CountPieces(const Trajectory& estimate, int64_t period_ns) {
  int pieces = estimate.empty() ? 0 : 1;
  for (std::size_t i = 1; i < estimate.size(); ++i) {
    const auto gap_ns = static_cast<double>(estimate[i].stamp_ns - estimate[i - 1].stamp_ns);
    if (gap_ns > kMaxGapFrames * static_cast<double>(period_ns)) ++pieces;
  }
  return pieces;
}

bool HasPoseWithin(const Trajectory& estimate, int64_t stamp_ns, int64_t tolerance_ns) {
  const auto next = std::lower_bound(
      estimate.begin(), estimate.end(), stamp_ns - tolerance_ns,
      [](const StampedPose& pose, int64_t stamp) { return pose.stamp_ns < stamp; });
  return next != estimate.end() && next->stamp_ns <= stamp_ns + tolerance_ns;
}

Coverage MeasureCoverage(const std::vector<int64_t>& reference_stamps_ns,
                         const Trajectory& estimate, int64_t period_ns) {
  const auto tolerance_ns = static_cast<int64_t>(kCoveredFrames * static_cast<double>(period_ns));
  const int64_t initialised_ns = reference_stamps_ns.front() + ToNanoseconds(kInitialisation_s);
  int64_t covered = 0, later = 0, later_covered = 0;
  for (const int64_t stamp_ns : reference_stamps_ns) {
    const bool has_pose = HasPoseWithin(estimate, stamp_ns, tolerance_ns);
    covered += has_pose;
    if (stamp_ns < initialised_ns) continue;
    ++later;
    later_covered += has_pose;
  }
  Coverage coverage;
  coverage.overall = static_cast<double>(covered) / static_cast<double>(reference_stamps_ns.size());
  coverage.after_initialisation =
      later == 0 ? coverage.overall
                 : static_cast<double>(later_covered) / static_cast<double>(later);
  coverage.flagged = coverage.after_initialisation < kMinCoverage;
  return coverage;
}

// Travelled length up to each pose, of the truth.
std::vector<double> TruthLengths(const std::vector<AssociatedPose>& poses) {
  std::vector<double> lengths_m(poses.size(), 0);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    lengths_m[i] =
        lengths_m[i - 1] +
        (poses[i].T_world_truth.translation - poses[i - 1].T_world_truth.translation).norm();
  }
  return lengths_m;
}

// The largest distance of a pose from the first one, of truth or estimate.
double ExtentOfPath(const std::vector<AssociatedPose>& poses) {
  double extent_m = 0;
  for (const AssociatedPose& pose : poses) {
    for (const auto member : {&AssociatedPose::T_world_truth, &AssociatedPose::T_world_estimate}) {
      const double distance_m =
          ((pose.*member).translation - (poses.front().*member).translation).norm();
      extent_m = std::max(extent_m, distance_m);
    }
  }
  return extent_m;
}

AbsoluteError MeasureAbsolute(AlignmentKind kind, const std::vector<AssociatedPose>& poses,
                              double length_m) {
  Eigen::Matrix3Xd estimate(3, poses.size()), truth(3, poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    estimate.col(static_cast<Eigen::Index>(i)) = poses[i].T_world_estimate.translation;
    truth.col(static_cast<Eigen::Index>(i)) = poses[i].T_world_truth.translation;
  }
  AbsoluteError error;
  error.kind = kind;
  error.alignment = Align(kind, estimate, truth);
  const Eigen::Quaterniond& R_truth_estimate = error.alignment.T_truth_estimate.rotation;
  for (const AssociatedPose& pose : poses) {
    const Eigen::Vector3d p = error.alignment.Position(pose.T_world_estimate.translation);
    error.position_errors_m.push_back((p - pose.T_world_truth.translation).norm());
    error.rotation_errors_deg.push_back(
        AngleDeg(pose.T_world_truth.rotation.conjugate() * R_truth_estimate *
                 pose.T_world_estimate.rotation));
  }
  error.position_m = Statistics(error.position_errors_m);
  error.rotation_deg = Statistics(error.rotation_errors_deg);
  error.rmse_percent = 100 * ComputeShare(error.position_m.rmse, length_m);
  return error;
}

// T_truth^-1 T_estimate of the motion between two poses.
RigidTransform MotionError(const AssociatedPose& from, const AssociatedPose& to) {
  const RigidTransform truth = from.T_world_truth.Inverse() * to.T_world_truth;
  const RigidTransform estimate = from.T_world_estimate.Inverse() * to.T_world_estimate;
  return truth.Inverse() * estimate;
}

RelativeError MeasureRelative(const std::vector<AssociatedPose>& poses,
                              const std::vector<double>& lengths_m, double length_m) {
  std::vector<double> percent, degrees, degrees_per_m;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto end = std::lower_bound(lengths_m.begin(), lengths_m.end(), lengths_m[i] + length_m);
    if (end == lengths_m.end()) break;
    const double travelled_m = *end - lengths_m[i];
    const RigidTransform error =
        MotionError(poses[i], poses[static_cast<std::size_t>(end - lengths_m.begin())]);
    percent.push_back(100 * error.translation.norm() / travelled_m);
    degrees.push_back(AngleDeg(error.rotation));
    degrees_per_m.push_back(degrees.back() / travelled_m);
  }
  if (percent.empty()) return {length_m, 0, kNoFigure, kNoFigure, kNoFigure, kNoFigure};
  return {length_m,
          static_cast<int64_t>(percent.size()),
          RootMeanSquare(percent),
          ComputeMiddle(percent),
          RootMeanSquare(degrees),
          RootMeanSquare(degrees_per_m)};
}

std::optional<LoopError> MeasureLoop(const std::vector<AssociatedPose>& poses, double length_m,
                                     double max_gap) {
  const AssociatedPose &first = poses.front(), &last = poses.back();
  const double gap_m = (last.T_world_truth.translation - first.T_world_truth.translation).norm();
  if (length_m <= 0 || gap_m > max_gap * length_m) return std::nullopt;
  const double distance_m = MotionError(first, last).translation.norm();
  return LoopError{distance_m, 100 * distance_m / length_m};
}

// By how much the estimate's heading is more than the truth's. The rotation between the two worlds
// is nearly one about the vertical; its yaw is the angle of the nearest such rotation.
double HeadingDifference(const AssociatedPose& pose) {
  const Eigen::Matrix3d R =
      (pose.T_world_estimate.rotation * pose.T_world_truth.rotation.conjugate()).toRotationMatrix();
  return std::atan2(R(1, 0) - R(0, 1), R(0, 0) + R(1, 1));
}

double MeasureHeading(const std::vector<AssociatedPose>& poses) {
  const double difference_rad = HeadingDifference(poses.back()) - HeadingDifference(poses.front());
  return std::remainder(difference_rad, 2 * M_PI) * kDegreesPerRadian;
}

}  // namespace

ErrorStatistics Statistics(std::vector<double> errors) {
  ErrorStatistics statistics;
  statistics.rmse = RootMeanSquare(errors);
  statistics.mean =
      std::accumulate(errors.begin(), errors.end(), 0.0) / static_cast<double>(errors.size());
  statistics.max = *std::max_element(errors.begin(), errors.end());
  statistics.median = ComputeMiddle(std::move(errors));
  return statistics;
}

double MeasurePathLength_m(const Trajectory& trajectory) {
  double length_m = 0;
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    length_m +=
        (trajectory[i].T_world_imu.translation - trajectory[i - 1].T_world_imu.translation).norm();
  }
  return length_m;
}

TrajectoryMetrics EvaluateTrajectory(const Trajectory& truth, const Trajectory& estimate,
                                     const std::vector<int64_t>& reference_stamps_ns,
                                     double max_truth_gap_s) {
  if (!(max_truth_gap_s > 0)) {
    throw ConfigError(
        fmt::format("--max-truth-gap: found {}, expected more than 0 s", max_truth_gap_s));
  }
  TrajectoryMetrics metrics;
  metrics.poses = Associate(truth, estimate, max_truth_gap_s);
  if (metrics.poses.size() < 3) {
    throw DataError(
        fmt::format("found {} of {} estimated poses with a truth at their stamp, expected "
                    "at least 3: are both files of the same recording and clock?",
                    metrics.poses.size(), estimate.size()));
  }
  if (const double extent_m = ExtentOfPath(metrics.poses); extent_m < kMinExtent_m) {
    throw DataError(
        fmt::format("found {} poses within {:.3g} m of each other, expected a path of at least {} "
                    "m: at rest nothing can be aligned, and no error be measured",
                    metrics.poses.size(), extent_m, kMinExtent_m));
  }
  const int64_t period_ns = FramePeriod(estimate);
  metrics.estimated_poses = static_cast<int64_t>(estimate.size());
  metrics.pieces = CountPieces(estimate, period_ns);

  std::vector<int64_t> stamps_ns = reference_stamps_ns;
  if (stamps_ns.empty()) {
    for (const StampedPose& pose : truth) stamps_ns.push_back(pose.stamp_ns);
  }
  metrics.coverage = MeasureCoverage(stamps_ns, estimate, period_ns);

  const std::vector<double> lengths_m = TruthLengths(metrics.poses);
  metrics.truth_length_m = lengths_m.back();
  metrics.estimate_length_m = MeasurePathLength_m(estimate);
  for (const AlignmentKind kind :
       {AlignmentKind::kPositionYaw, AlignmentKind::kRigid, AlignmentKind::kSimilarity}) {
    metrics.absolute.push_back(MeasureAbsolute(kind, metrics.poses, metrics.truth_length_m));
  }
  for (const double length_m : {1.0, 5.0, 10.0}) {
    metrics.relative.push_back(MeasureRelative(metrics.poses, lengths_m, length_m));
  }
  metrics.loop = MeasureLoop(metrics.poses, metrics.truth_length_m, kMaxLoopGap);
  metrics.heading_error_deg = MeasureHeading(metrics.poses);
  return metrics;
}

}  // namespace slcmap::evaluation
