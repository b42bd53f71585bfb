#include "odometry/structure/slope_detector.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "data/core/math.h"

namespace slcmap::inline odometry {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// Which lines vote: as their own observations have them.
constexpr double kMinLength_m = 0.7;        // crates that lie about are shorter
constexpr double kMaxLineSigma_rad = 0.02;  // of its direction
// From the vertical, the level, the axes of the building and other slopes, and at least so many
// standard deviations.
constexpr double kSlopeMinSeparation_rad = 0.05;
constexpr int kMemoryKeyframes = 30;  // a line is remembered so long since it was last seen
constexpr int kMinLines = 5;          // of a slope that is certain
constexpr int kMinObjects = 3;        // that they belong to, and
// these are so far from each other: a box has edges all around
constexpr double kMinApart_m = 0.25;
constexpr double kMaxSigma_rad = 0.01;

// A line's direction across a slope, and its covariance there.
struct Across {
  Vector2d off_rad;
  Matrix2d covariance_rad2;
};

Across AcrossSlope(const FreeLine& line, const SlopeBlock& slope) {
  const Matrix32d across = AxesAcrossSlope(slope.data());
  const double sign = line.direction_world.dot(SlopeDirection(slope.data())) < 0 ? -1 : 1;
  return {sign * across.transpose() * line.direction_world,
          across.transpose() * line.direction_covariance_rad2 * across};
}

double LargestSigma(const Matrix2d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Matrix2d> solver(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues()[1]));
}

// Edges within so much of one another, across the slope, count as one object.
int CountObjects(const std::vector<const FreeLine*>& lines, const SlopeBlock& slope,
                 double min_apart_m) {
  const Matrix32d across = AxesAcrossSlope(slope.data());
  std::vector<Vector2d> objects;
  for (const FreeLine* line : lines) {
    const Vector2d place = across.transpose() * line->middle_world;
    const bool is_new = std::ranges::none_of(
        objects, [&](const Vector2d& other) { return (place - other).norm() < min_apart_m; });
    if (is_new) objects.push_back(place);
  }
  return static_cast<int>(objects.size());
}

std::vector<const FreeLine*> FindFollowers(const std::vector<const FreeLine*>& lines,
                                           const SlopeBlock& slope) {
  const Vector3d direction = SlopeDirection(slope.data());
  const double least_cosine = std::cos(kMaxAngleToDirection_rad);
  std::vector<const FreeLine*> followers;
  for (const FreeLine* line : lines) {
    if (std::abs(line->direction_world.dot(direction)) < least_cosine) continue;
    const auto off = SquaredSigmasOff(*line, slope, kSlopeSearchSigma_rad);
    if (off && *off <= kMaxSigmasToDirection * kMaxSigmasToDirection) followers.push_back(line);
  }
  return followers;
}

// The weighted mean of the directions of lines, and its standard deviation.
double ComputeMean(const std::vector<const FreeLine*>& lines, SlopeBlock* slope) {
  Matrix2d information = Matrix2d::Zero();
  Vector2d sum = Vector2d::Zero();
  const Matrix2d own = kSlopeSearchSigma_rad * kSlopeSearchSigma_rad * Matrix2d::Identity();
  for (const FreeLine* line : lines) {
    const Across across = AcrossSlope(*line, *slope);
    const Matrix2d weight = (across.covariance_rad2 + own).inverse();
    information += weight;
    sum += weight * across.off_rad;
  }
  const Matrix2d covariance = information.inverse();
  *slope = MakeSlope(SlopeDirection(slope->data()) +
                     AxesAcrossSlope(slope->data()) * (covariance * sum));
  return LargestSigma(covariance);
}

}  // namespace

std::optional<double> SquaredSigmasOff(const FreeLine& line, const SlopeBlock& slope,
                                       double deviation_sigma_rad) {
  const Across across = AcrossSlope(line, slope);
  if (LineAngle_rad(line.direction_world, SlopeDirection(slope.data())) >
          kMaxAngleToDirection_rad ||
      LargestSigma(across.covariance_rad2) > kMaxLineSigma_rad) {
    return std::nullopt;
  }
  const Matrix2d covariance =
      across.covariance_rad2 + deviation_sigma_rad * deviation_sigma_rad * Matrix2d::Identity();
  return across.off_rad.dot(covariance.ldlt().solve(across.off_rad));
}

bool MaySlope(const FreeLine& line, const std::vector<Vector3d>& axes_world,
              const std::vector<SlopeBlock>& slopes) {
  const SlopeBlock own = MakeSlope(line.direction_world);
  const double sigma_rad = LargestSigma(AcrossSlope(line, own).covariance_rad2);
  const double apart_rad = std::max(kSlopeMinSeparation_rad, kMinSigmasToOthers * sigma_rad);
  if (sigma_rad > kMaxLineSigma_rad || own[1] < apart_rad) return false;
  const auto is_other = [&](const Vector3d& known) {
    return LineAngle_rad(line.direction_world, known) >= apart_rad;
  };
  return is_other(Vector3d::UnitZ()) && std::ranges::all_of(axes_world, is_other) &&
         std::ranges::all_of(slopes, [&](const SlopeBlock& slope) {
           return is_other(SlopeDirection(slope.data()));
         });
}

std::optional<SlopeEvidence> SlopeDetector::AddKeyframe(const std::vector<FreeLine>& lines,
                                                        const std::vector<Vector3d>& axes_world,
                                                        const std::vector<SlopeBlock>& slopes) {
  ++keyframes_;
  for (const FreeLine& line : lines) lines_[line.id] = {line, keyframes_};
  std::erase_if(lines_, [&](const auto& entry) {
    return entry.second.keyframe <= keyframes_ - kMemoryKeyframes;
  });
  const auto best = Best(axes_world, slopes);
  const bool certain = best && best->lines >= kMinLines && best->objects >= kMinObjects &&
                       best->sigma_rad <= kMaxSigma_rad;
  return certain ? best : std::nullopt;
}

std::optional<SlopeEvidence> SlopeDetector::Best(const std::vector<Vector3d>& axes_world,
                                                 const std::vector<SlopeBlock>& slopes) const {
  std::vector<const FreeLine*> candidates;
  for (const auto& [id, remembered] : lines_) {
    const FreeLine& line = remembered.line;
    if (line.length_m < kMinLength_m) continue;
    if (MaySlope(line, axes_world, slopes)) candidates.push_back(&line);
  }
  std::optional<SlopeEvidence> best;
  for (const FreeLine* seed : candidates) {
    SlopeEvidence evidence{MakeSlope(seed->direction_world), 0, 0, 0};
    std::vector<const FreeLine*> followers;
    for (int i = 0; i < 3; ++i) {
      followers = FindFollowers(candidates, evidence.angles_rad);
      if (followers.empty()) break;
      evidence.sigma_rad = ComputeMean(followers, &evidence.angles_rad);
    }
    evidence.lines = static_cast<int>(followers.size());
    evidence.objects = CountObjects(followers, evidence.angles_rad, kMinApart_m);
    if (!best ||
        std::pair(evidence.objects, evidence.lines) > std::pair(best->objects, best->lines)) {
      best = evidence;
    }
  }
  return best;
}

void SlopeDetector::Reset() {
  lines_.clear();
  keyframes_ = 0;
}

}  // namespace slcmap::odometry
