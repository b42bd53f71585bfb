#include "apps/evaluation/cloud_flatness.h"

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "apps/evaluation/direction_metrics.h"
#include "data/option_table.h"

namespace slcmap {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kLeastVariance_m2 = 1e-12;  // of a micrometre: keeps the entropy finite

constexpr OptionTable kFlatnessTable{
    Option{"radius_m", &FlatnessOptions::radius_m, 1e-3, 10.0},
    Option{"min_neighbours", &FlatnessOptions::min_neighbours, 4, 10000},
    Option{"max_points", &FlatnessOptions::max_points, 1, 100000000},
    Option{"max_neighbours", &FlatnessOptions::max_neighbours, 4, 100000},
    Option{"max_angle_deg", &FlatnessOptions::max_angle_deg, 0.1, 20.0},
    Option{"max_flatness", &FlatnessOptions::max_flatness, 0.0, 1.0}};

// The variances of a neighbourhood along its principal directions, ascending.
struct Neighbourhood {
  Vector3d variances_m2;
  Vector3d normal;
};

class Neighbourhoods {
 public:
  Neighbourhoods(const std::vector<Vector3d>& points, const FlatnessOptions& options)
      : points_(points), options_(options), cloud_(pcl::make_shared<Cloud>()) {
    for (const Vector3d& p : points) {
      const Eigen::Vector3f f = (p - points.front()).cast<float>();
      cloud_->push_back({f.x(), f.y(), f.z()});
    }
    tree_.setInputCloud(cloud_);
  }

  std::optional<Neighbourhood> Around(size_t point) {
    tree_.radiusSearch((*cloud_)[point], options_.radius_m, found_, squared_m2_);
    if (static_cast<int>(found_.size()) < options_.min_neighbours) return std::nullopt;
    const size_t step = (found_.size() + options_.max_neighbours - 1) /
                        static_cast<size_t>(options_.max_neighbours);
    Vector3d mean = Vector3d::Zero();
    Matrix3d products = Matrix3d::Zero();
    double count = 0;
    for (size_t i = 0; i < found_.size(); i += step) {
      const Vector3d offset = points_[static_cast<size_t>(found_[i])] - points_[point];
      mean += offset;
      products += offset * offset.transpose();
      ++count;
    }
    mean /= count;
    // Unbiased, so that thinning a cloud does not make it flatter.
    const Matrix3d covariance = (products - count * mean * mean.transpose()) / (count - 1);
    const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(covariance);
    return Neighbourhood{solver.eigenvalues().cwiseMax(kLeastVariance_m2),
                         solver.eigenvectors().col(0)};
  }

 private:
  using Cloud = pcl::PointCloud<pcl::PointXYZ>;
  const std::vector<Vector3d>& points_;
  const FlatnessOptions& options_;
  Cloud::Ptr cloud_;
  pcl::KdTreeFLANN<pcl::PointXYZ> tree_;
  pcl::Indices found_;
  std::vector<float> squared_m2_;
};

double Entropy(const Neighbourhood& n) {
  const double two_pi_e = 2 * std::numbers::pi * std::numbers::e;
  return 0.5 * (3 * std::log(two_pi_e) + n.variances_m2.array().log().sum());
}

// Over the neighbourhoods whose normals are along three directions at right angles.
void MeasureOrthogonalPlanes(const std::vector<Neighbourhood>& all, const FlatnessOptions& options,
                             FlatnessMetrics* metrics) {
  std::vector<WeightedDirection> normals;
  std::vector<double> variances_m2;
  for (const Neighbourhood& n : all) {
    if (n.variances_m2[0] > options.max_flatness * n.variances_m2[1]) continue;
    normals.push_back({n.normal, 1});
    variances_m2.push_back(n.variances_m2[0]);
  }
  const auto directions =
      MeasureDirections(normals, {.max_angle_deg = options.max_angle_deg, .min_weight = 0});
  if (!directions) return;
  double sum = 0;
  for (size_t i = 0; i < normals.size(); ++i) {
    if (!AxisOf(directions->axes, normals[i].direction, options.max_angle_deg)) continue;
    sum += variances_m2[i];
    ++metrics->on_planes;
  }
  if (metrics->on_planes > 0) metrics->mom_m2 = sum / static_cast<double>(metrics->on_planes);
}

}  // namespace

void FlatnessOptions::Check() const { kFlatnessTable.Check("flatness", *this); }

double FlatnessMetrics::thickness_m() const { return std::sqrt(mpv_m2); }

std::optional<FlatnessMetrics> MeasureFlatness(const std::vector<Vector3d>& points,
                                               const FlatnessOptions& options,
                                               const Progress& progress) {
  options.Check();
  if (points.empty()) return std::nullopt;
  Neighbourhoods neighbourhoods(points, options);
  std::vector<Neighbourhood> all;
  const size_t step =
      (points.size() + options.max_points - 1) / static_cast<size_t>(options.max_points);
  for (size_t i = 0; i < points.size(); i += step) {
    if (i % 100 == 0) {
      progress.ReportOrStop(static_cast<double>(i) / static_cast<double>(points.size()));
    }
    if (const auto neighbourhood = neighbourhoods.Around(i)) all.push_back(*neighbourhood);
  }
  if (all.empty()) return std::nullopt;
  FlatnessMetrics metrics;
  metrics.points = static_cast<int64_t>(points.size());
  metrics.looked_at = static_cast<int64_t>(all.size());
  for (const Neighbourhood& n : all) {
    metrics.mpv_m2 += n.variances_m2[0] / static_cast<double>(all.size());
    metrics.mme += Entropy(n) / static_cast<double>(all.size());
  }
  MeasureOrthogonalPlanes(all, options, &metrics);
  return metrics;
}

}  // namespace slcmap
