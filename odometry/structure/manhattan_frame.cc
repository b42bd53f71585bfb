#include "odometry/structure/manhattan_frame.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "data/rigid_transform.h"
#include "odometry/structure/interpretation_plane.h"

namespace slcmap {
namespace {

struct Sight {
  int segment = 0;  // its index
  InterpretationPlane plane;
};

// One segment of a direction and another of a second one leave the first unknown by a turn in the
// first plane; a third one that shares the first direction fixes it.
class FrameSearch {
 public:
  FrameSearch(const std::vector<LineSegment>& segments, double focal_px,
              const std::optional<Eigen::Vector3d>& up_camera, const ManhattanFrameOptions& options)
      : options_(options), up_camera_(up_camera) {
    for (size_t i = 0; i < segments.size(); ++i) {
      if (segments[i].Length() * focal_px < options.min_length_px) continue;
      sights_.push_back(
          {static_cast<int>(i), PlaneOfSegment(segments[i], options.end_sigma_px / focal_px)});
      total_rad_ += sights_.back().plane.length_rad;
    }
  }

  bool HasEnough() const { return static_cast<int>(sights_.size()) >= options_.min_segments; }

  // The best of all trials; columns are the three directions, in no certain order but for the last,
  // which is the prior where there is one.
  Eigen::Matrix3d Search() const {
    std::mt19937 random(7);
    Eigen::Matrix3d best = Eigen::Matrix3d::Identity();
    double best_score = -1;
    for (int trial = 0; trial < options_.max_trials; ++trial) {
      const auto axes = up_camera_ ? TripleAboutPrior(&random) : Triple(&random);
      if (!axes) continue;
      const double score = Score(*axes);
      if (score <= best_score) continue;
      best_score = score;
      best = *axes;
    }
    return best;
  }

  // Gauss-Newton over R Exp(delta), with weights that fade out (Tukey's biweight).
  Eigen::Matrix3d Refine(Eigen::Matrix3d R) const {
    for (int iteration = 0; iteration < 10; ++iteration) {
      Eigen::Matrix3d H = 1e-9 * Eigen::Matrix3d::Identity();
      Eigen::Vector3d b = Eigen::Vector3d::Zero();
      for (const Sight& sight : sights_) AddTerm(sight.plane, R, &H, &b);
      if (up_camera_) AddPrior(R, &H, &b);
      R = R * ExpRotation(H.ldlt().solve(-b)).toRotationMatrix();
    }
    return R;
  }

  // Which axis each segment follows; the angle decides, and the threshold.
  int AxisOf(const InterpretationPlane& plane, const Eigen::Matrix3d& R) const {
    int best = -1;
    double best_rad = options_.max_angle_rad;
    for (int axis = 0; axis < 3; ++axis) {
      const double angle_rad = AngleToVanishingPoint(plane, R.col(axis), 0).angle_rad;
      if (angle_rad >= best_rad) continue;
      best = axis;
      best_rad = angle_rad;
    }
    return best;
  }

  std::optional<ManhattanFrame> Describe(const Eigen::Matrix3d& R, size_t segments) const {
    ManhattanFrame frame;
    frame.R_camera_manhattan = R;
    frame.axes.assign(segments, -1);
    double explained_rad = 0;
    std::array<int, 3> count = {0, 0, 0};
    for (const Sight& sight : sights_) {
      const int axis = AxisOf(sight.plane, R);
      frame.axes[sight.segment] = axis;
      if (axis < 0) continue;
      ++count[axis];
      explained_rad += sight.plane.length_rad;
    }
    frame.explained_share = explained_rad / total_rad_;
    std::sort(count.begin(), count.end());
    if (count[0] + count[1] + count[2] < options_.min_segments) return std::nullopt;
    if (count[1] < options_.min_segments_second) return std::nullopt;
    if (frame.explained_share < options_.min_share) return std::nullopt;
    return frame;
  }

 private:
  const Eigen::Vector3d& RandomNormal(std::mt19937* random) const {
    // Not std::uniform_int_distribution, whose numbers differ between libraries.
    return sights_[(*random)() % sights_.size()].plane.normal;
  }

  // The axes for which two segments share the first direction and a third has the second.
  std::optional<Eigen::Matrix3d> Triple(std::mt19937* random) const {
    const Eigen::Vector3d first = RandomNormal(random).cross(RandomNormal(random));
    return FromTwo(first, first.cross(RandomNormal(random)));
  }

  // The vertical is near its prior: where two segments do not agree on it, it is the prior.
  std::optional<Eigen::Matrix3d> TripleAboutPrior(std::mt19937* random) const {
    Eigen::Vector3d up = RandomNormal(random).cross(RandomNormal(random));
    if (up.dot(*up_camera_) < 0) up = -up;
    const double cosine = up.norm() > 1e-6 ? up.normalized().dot(*up_camera_) : 0;
    if (cosine < std::cos(options_.max_prior_angle_rad)) up = *up_camera_;
    const auto axes = FromTwo(up, up.cross(RandomNormal(random)));
    if (!axes) return std::nullopt;
    Eigen::Matrix3d up_last;
    up_last << axes->col(1), axes->col(2), axes->col(0);
    return up_last;
  }

  static std::optional<Eigen::Matrix3d> FromTwo(const Eigen::Vector3d& first,
                                                const Eigen::Vector3d& second) {
    if (first.norm() < 1e-3 || second.norm() < 1e-3 * first.norm()) return std::nullopt;
    Eigen::Matrix3d axes;
    axes.col(0) = first.normalized();
    axes.col(1) = second.normalized();
    axes.col(2) = axes.col(0).cross(axes.col(1));
    return axes;
  }

  // Length that follows, counting less the less exactly.
  double Score(const Eigen::Matrix3d& axes) const {
    double score = 0;
    for (const Sight& sight : sights_) {
      double best = 0;
      for (int axis = 0; axis < 3; ++axis)
        best = std::max(best, Weight(sight.plane, axes.col(axis)));
      score += best * sight.plane.length_rad;
    }
    return score;
  }

  double Weight(const InterpretationPlane& plane, const Eigen::Vector3d& direction) const {
    const double u = AngleToVanishingPoint(plane, direction, 0).angle_rad / options_.max_angle_rad;
    const double v = std::max(0.0, 1 - u * u);
    return v * v;
  }

  // r = n . d_k, with d_k = R Exp(delta) e_k, so that dr/ddelta = (e_k x R^T n)^T.
  void AddTerm(const InterpretationPlane& plane, const Eigen::Matrix3d& R, Eigen::Matrix3d* H,
               Eigen::Vector3d* b) const {
    const int axis = AxisOf(plane, R);
    if (axis < 0) return;
    const double along = std::max(std::abs(plane.along.dot(R.col(axis))), 1e-3);
    const double sigma = plane.sigma_rad * along;
    const double w = Weight(plane, R.col(axis)) / (sigma * sigma);
    const Eigen::Vector3d n = R.transpose() * plane.normal;
    const Eigen::Vector3d J = Eigen::Vector3d::Unit(axis).cross(n);
    *H += w * J * J.transpose();
    *b += w * n(axis) * J;
  }

  // r = across . d_3 for two directions at right angles to the prior.
  void AddPrior(const Eigen::Matrix3d& R, Eigen::Matrix3d* H, Eigen::Vector3d* b) const {
    const Eigen::Vector3d first = up_camera_->unitOrthogonal();
    const double w = 1 / (options_.prior_sigma_rad * options_.prior_sigma_rad);
    for (const Eigen::Vector3d& across : {first, Eigen::Vector3d(up_camera_->cross(first))}) {
      const Eigen::Vector3d n = R.transpose() * across;
      const Eigen::Vector3d J = Eigen::Vector3d::UnitZ().cross(n);
      *H += w * J * J.transpose();
      *b += w * n.z() * J;
    }
  }

  ManhattanFrameOptions options_;
  std::optional<Eigen::Vector3d> up_camera_;
  std::vector<Sight> sights_;
  double total_rad_ = 0;
};

// The same three axes, named: up last, the one ahead first.
Eigen::Matrix3d Ordered(const Eigen::Matrix3d& axes, const Eigen::Vector3d& up_camera) {
  int vertical = 0;
  (up_camera.transpose() * axes).cwiseAbs().maxCoeff(&vertical);
  Eigen::Vector3d z = axes.col(vertical);
  if (z.dot(up_camera) < 0) z = -z;
  const Eigen::Vector3d a = axes.col((vertical + 1) % 3), b = axes.col((vertical + 2) % 3);
  Eigen::Vector3d x = std::abs(a.z()) >= std::abs(b.z()) ? a : b;
  if (x.z() < 0) x = -x;
  Eigen::Matrix3d out;
  out << x, z.cross(x), z;
  return out;
}

}  // namespace

std::optional<ManhattanFrame> DetectManhattanFrame(const std::vector<LineSegment>& segments,
                                                   double focal_px,
                                                   const std::optional<Eigen::Vector3d>& up_camera,
                                                   const ManhattanFrameOptions& options) {
  const FrameSearch search(segments, focal_px, up_camera, options);
  if (!search.HasEnough()) return std::nullopt;
  const Eigen::Matrix3d R = search.Refine(search.Search());
  const Eigen::Vector3d up = up_camera.value_or(-Eigen::Vector3d::UnitY());
  return search.Describe(Ordered(R, up), segments.size());
}

}  // namespace slcmap
