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

std::vector<const FreeLine*> FindFollowers(const SlopeOptions& options,
                                           const std::vector<const FreeLine*>& lines,
                                           const SlopeBlock& slope) {
  const Vector3d direction = SlopeDirection(slope.data());
  const double least_cosine = std::cos(options.max_angle_rad);
  std::vector<const FreeLine*> followers;
  for (const FreeLine* line : lines) {
    if (std::abs(line->direction_world.dot(direction)) < least_cosine) continue;
    const auto off = SquaredSigmasOff(options, *line, slope, options.search_sigma_rad);
    if (off && *off <= options.max_sigmas * options.max_sigmas) followers.push_back(line);
  }
  return followers;
}

// The weighted mean of the directions of lines, and its standard deviation.
double ComputeMean(const SlopeOptions& options, const std::vector<const FreeLine*>& lines,
                   SlopeBlock* slope) {
  Matrix2d information = Matrix2d::Zero();
  Vector2d sum = Vector2d::Zero();
  const Matrix2d own = options.search_sigma_rad * options.search_sigma_rad * Matrix2d::Identity();
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

std::optional<double> SquaredSigmasOff(const SlopeOptions& options, const FreeLine& line,
                                       const SlopeBlock& slope, double deviation_sigma_rad) {
  const Across across = AcrossSlope(line, slope);
  if (LineAngle_rad(line.direction_world, SlopeDirection(slope.data())) > options.max_angle_rad ||
      LargestSigma(across.covariance_rad2) > options.max_line_sigma_rad) {
    return std::nullopt;
  }
  const Matrix2d covariance =
      across.covariance_rad2 + deviation_sigma_rad * deviation_sigma_rad * Matrix2d::Identity();
  return across.off_rad.dot(covariance.ldlt().solve(across.off_rad));
}

bool MaySlope(const SlopeOptions& options, const FreeLine& line,
              const std::vector<Vector3d>& axes_world, const std::vector<SlopeBlock>& slopes) {
  const SlopeBlock own = MakeSlope(line.direction_world);
  const double sigma_rad = LargestSigma(AcrossSlope(line, own).covariance_rad2);
  const double apart_rad =
      std::max(options.min_separation_rad, options.min_other_sigmas * sigma_rad);
  if (sigma_rad > options.max_line_sigma_rad || own[1] < apart_rad) return false;
  const auto is_other = [&](const Vector3d& known) {
    return LineAngle_rad(line.direction_world, known) >= apart_rad;
  };
  return is_other(Vector3d::UnitZ()) && std::ranges::all_of(axes_world, is_other) &&
         std::ranges::all_of(slopes, [&](const SlopeBlock& slope) {
           return is_other(SlopeDirection(slope.data()));
         });
}

SlopeDetector::SlopeDetector(const SlopeOptions& options) : options_(options) { options_.Check(); }

std::optional<SlopeEvidence> SlopeDetector::AddKeyframe(const std::vector<FreeLine>& lines,
                                                        const std::vector<Vector3d>& axes_world,
                                                        const std::vector<SlopeBlock>& slopes) {
  ++keyframes_;
  for (const FreeLine& line : lines) lines_[line.id] = {line, keyframes_};
  std::erase_if(lines_, [&](const auto& entry) {
    return entry.second.keyframe <= keyframes_ - options_.memory_keyframes;
  });
  const auto best = Best(axes_world, slopes);
  const bool certain = best && best->lines >= options_.min_lines &&
                       best->objects >= options_.min_objects &&
                       best->sigma_rad <= options_.max_sigma_rad;
  return certain ? best : std::nullopt;
}

std::optional<SlopeEvidence> SlopeDetector::Best(const std::vector<Vector3d>& axes_world,
                                                 const std::vector<SlopeBlock>& slopes) const {
  std::vector<const FreeLine*> candidates;
  for (const auto& [id, remembered] : lines_) {
    const FreeLine& line = remembered.line;
    if (line.length_m < options_.min_length_m) continue;
    if (MaySlope(options_, line, axes_world, slopes)) candidates.push_back(&line);
  }
  std::optional<SlopeEvidence> best;
  for (const FreeLine* seed : candidates) {
    SlopeEvidence evidence{MakeSlope(seed->direction_world), 0, 0, 0};
    std::vector<const FreeLine*> followers;
    for (int i = 0; i < 3; ++i) {
      followers = FindFollowers(options_, candidates, evidence.angles_rad);
      if (followers.empty()) break;
      evidence.sigma_rad = ComputeMean(options_, followers, &evidence.angles_rad);
    }
    evidence.lines = static_cast<int>(followers.size());
    evidence.objects = CountObjects(followers, evidence.angles_rad, options_.min_apart_m);
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
