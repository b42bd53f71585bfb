#include "mapping/merge/alignment_features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

namespace slcmap {
namespace {

constexpr double kQuarter_rad = std::numbers::pi / 2;
constexpr int kHeadingBins = 180;         // of half a degree
constexpr int kHeadingBlur = 2;           // bins on either side
constexpr int kBetweenHeadings = 8;       // bins
constexpr double kLeastHeading = 0.12;    // of the strongest
constexpr std::size_t kMostHeadings = 4;  // of a building with wings
constexpr double kUprightNormal_z = 0.2, kLevelDirection_z = 0.1;

using CubeKey = std::array<int64_t, 4>;  // and where it faces

CubeKey CubeOf(const DensePoint& point) {
  int axis = 0;
  point.normal_world.cwiseAbs().maxCoeff(&axis);
  const auto index = [&](int i) {
    return static_cast<int64_t>(std::floor(point.p_world[i] / kSurfaceSample_m));
  };
  return {index(0), index(1), index(2), 2 * axis + (point.normal_world[axis] < 0 ? 1 : 0)};
}

std::vector<SurfaceSample> SampleSurfaces(const std::vector<DensePoint>& points) {
  struct Sum {
    Eigen::Vector3d p = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
    double weight = 0;
  };
  std::map<CubeKey, Sum> cubes;
  for (const DensePoint& point : points) {
    const double sigma_m = std::max(point.sigma_m, 0.002), weight = 1 / (sigma_m * sigma_m);
    Sum& sum = cubes[CubeOf(point)];
    sum.p += weight * point.p_world;
    sum.normal += weight * point.normal_world;
    sum.weight += weight;
  }
  std::vector<SurfaceSample> samples;
  for (const auto& [key, sum] : cubes) {
    samples.push_back({sum.p / sum.weight, sum.normal.normalized()});
  }
  return samples;
}

void SampleLines(const std::vector<MapLine>& lines, std::vector<LinePlace>* places) {
  for (const MapLine& line : lines) {
    const Eigen::Vector3d way = line.end_world - line.start_world;
    const double length_m = way.norm();
    const int count = static_cast<int>(std::lround(length_m / kLinePlace_m));
    for (int i = 0; i < count; ++i) {
      places->push_back({line.start_world + (i + 0.5) / count * way, way / length_m, line.sigma_m});
    }
  }
}

// The length along each direction about z, up to quarter turns.
class HeadingHistogram {
 public:
  void Add(const Eigen::Vector3d& direction, double weight) {
    const double quarters = std::atan2(direction.y(), direction.x()) / kQuarter_rad;
    const double share = quarters - std::floor(quarters);
    bins_[std::min(kHeadingBins - 1, static_cast<int>(share * kHeadingBins))] += weight;
  }

  std::vector<double> Peaks() const {
    std::vector<std::pair<double, int>> sums;
    for (int i = 0; i < kHeadingBins; ++i) sums.emplace_back(Around(i), i);
    std::stable_sort(sums.begin(), sums.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    std::vector<int> peaks;
    for (const auto& [sum, bin] : sums) {
      if (sum <= kLeastHeading * sums.front().first || peaks.size() == kMostHeadings) break;
      const auto is_near = [&, bin = bin](int other) {
        const int apart = std::abs(bin - other);
        return std::min(apart, kHeadingBins - apart) < kBetweenHeadings;
      };
      if (std::none_of(peaks.begin(), peaks.end(), is_near)) peaks.push_back(bin);
    }
    std::vector<double> headings_rad;
    for (const int peak : peaks) headings_rad.push_back(MeanAround(peak));
    return headings_rad;
  }

 private:
  double At(int bin) const { return bins_[(bin + kHeadingBins) % kHeadingBins]; }

  double Around(int bin) const {
    double sum = 0;
    for (int i = -kHeadingBlur; i <= kHeadingBlur; ++i) sum += At(bin + i);
    return sum;
  }

  double MeanAround(int bin) const {
    double moment = 0;
    for (int i = -kHeadingBlur; i <= kHeadingBlur; ++i) moment += i * At(bin + i);
    return (bin + 0.5 + moment / Around(bin)) / kHeadingBins * kQuarter_rad;
  }

  std::array<double, kHeadingBins> bins_ = {};
};

std::vector<double> HeadingsOf(const AlignmentFeatures& features) {
  HeadingHistogram histogram;
  for (const LinePlace& line : features.lines) {
    if (std::abs(line.direction_world.z()) < kLevelDirection_z) {
      histogram.Add(line.direction_world, kLinePlace_m);
    }
  }
  for (const SurfaceSample& surface : features.surfaces) {
    if (std::abs(surface.normal_world.z()) < kUprightNormal_z) {
      histogram.Add(surface.normal_world, kSurfaceSample_m * kSurfaceSample_m);
    }
  }
  return histogram.Peaks();
}

}  // namespace

AlignmentFeatures FeaturesOf(const MapResult& map) {
  AlignmentFeatures features;
  features.surfaces = SampleSurfaces(map.dense);
  SampleLines(map.lines, &features.lines);
  SampleLines(map.marks, &features.lines);
  features.headings_rad = HeadingsOf(features);
  return features;
}

RigidTransform LevelTransform(double yaw_rad, const Eigen::Vector3d& translation) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ())), translation};
}

double YawOf(const RigidTransform& transform) {
  const Eigen::Vector3d x = transform.rotation * Eigen::Vector3d::UnitX();
  return std::atan2(x.y(), x.x());
}

}  // namespace slcmap
