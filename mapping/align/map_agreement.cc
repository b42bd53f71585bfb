#include "mapping/align/map_agreement.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <unordered_map>

#include "mapping/map/point_index.h"

namespace slcmap::inline mapping {
namespace {

constexpr double kQuarter_rad = std::numbers::pi / 2;
constexpr int kHeadingBins = 180;         // of half a degree
constexpr int kHeadingBlur = 2;           // bins on either side
constexpr int kBetweenHeadings = 8;       // bins
constexpr double kLeastHeading = 0.12;    // of the strongest
constexpr std::size_t kMostHeadings = 4;  // of a building with wings
constexpr double kUprightNormal_z = 0.2, kLevelDirection_z = 0.1;

using CubeKey = std::array<int64_t, 4>;  // and where it faces

CubeKey FindPointCube(const DensePoint& point) {
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
    Sum& sum = cubes[FindPointCube(point)];
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

std::vector<double> FindHeadings(const AlignmentFeatures& features) {
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

AlignmentFeatures FindFeatures(const std::vector<MapLine>& lines) {
  AlignmentFeatures features;
  SampleLines(lines, &features.lines);
  features.headings_rad = FindHeadings(features);
  return features;
}

AlignmentFeatures FindFeatures(std::vector<SurfaceSample> surfaces) {
  AlignmentFeatures features;
  features.surfaces = std::move(surfaces);
  features.headings_rad = FindHeadings(features);
  return features;
}

AlignmentFeatures FindFeatures(const MapResult& map) {
  AlignmentFeatures features;
  features.surfaces = SampleSurfaces(map.dense);
  SampleLines(map.lines, &features.lines);
  SampleLines(map.marks, &features.lines);
  features.headings_rad = FindHeadings(features);
  return features;
}

RigidTransform LevelTransform(double yaw_rad, const Eigen::Vector3d& translation) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ())), translation};
}

double ComputeYaw(const RigidTransform& transform) {
  const Eigen::Vector3d x = transform.rotation * Eigen::Vector3d::UnitX();
  return std::atan2(x.y(), x.x());
}

namespace {

constexpr double kCell_m = 0.4;                      // of the index
constexpr double kFacing = 0.8;                      // cosine between normals of one surface
constexpr double kParallel = 0.995;                  // cosine between lines that are one
constexpr double kBeside_m = 0.3;                    // along a surface or line, to the next sample
constexpr double kSurface_m = 0.08, kLine_m = 0.04;  // across, of what agrees
constexpr double kSurfaceSample_m2 = kSurfaceSample_m * kSurfaceSample_m;

// Whether all around a place is known to be free, so that no surface is near.
bool IsFreeAround(const OccupancyMap& occupancy, const Eigen::Vector3d& p) {
  const double step_m = occupancy.resolution_m();
  for (int i = 0; i < kCubesAround; ++i) {
    const Eigen::Vector3d offset = CubeAround({0, 0, 0}, i).cast<double>();
    if (!occupancy.IsFree(p + step_m * offset)) return false;
  }
  return true;
}

bool IsKnown(const OccupancyMap& occupancy, const Eigen::Vector3d& p) {
  return occupancy.IsFree(p) || occupancy.IsOccupied(p);
}

}  // namespace

// Which samples are in a cell or beside it: they are asked for more often than they are added.
struct FeatureIndex::Cells {
  std::unordered_map<int64_t, std::vector<int>> near;

  void Add(const Eigen::Vector3d& p, int sample) {
    const Eigen::Vector3i cell = FindCube(p, kCell_m);
    for (int i = 0; i < kCubesAround; ++i) near[MakeKey(CubeAround(cell, i))].push_back(sample);
  }

  template <typename Visit>
  void ForEachNear(const Eigen::Vector3d& p, const Visit& visit) const {
    const auto found = near.find(MakeKey(FindCube(p, kCell_m)));
    if (found == near.end()) return;
    for (const int sample : found->second) visit(sample);
  }
};

FeatureIndex::FeatureIndex(const AlignmentFeatures& features)
    : features_(features), surfaces_(std::make_unique<Cells>()), lines_(std::make_unique<Cells>()) {
  for (std::size_t i = 0; i < features.surfaces.size(); ++i) {
    surfaces_->Add(features.surfaces[i].p_world, static_cast<int>(i));
  }
  for (std::size_t i = 0; i < features.lines.size(); ++i) {
    lines_->Add(features.lines[i].p_world, static_cast<int>(i));
  }
}

FeatureIndex::~FeatureIndex() = default;

const SurfaceSample* FeatureIndex::SurfaceNear(const Eigen::Vector3d& p,
                                               const Eigen::Vector3d& normal,
                                               double reach_m) const {
  const SurfaceSample* nearest = nullptr;
  double least_m = 1e9;
  surfaces_->ForEachNear(p, [&](int i) {
    const SurfaceSample& sample = features_.surfaces[i];
    if (sample.normal_world.dot(normal) < kFacing) return;
    const Eigen::Vector3d way = p - sample.p_world;
    const double across_m = std::abs(way.dot(sample.normal_world)), distance_m = way.norm();
    if (across_m > reach_m || distance_m > std::hypot(kBeside_m, across_m)) return;
    if (distance_m >= least_m) return;
    least_m = distance_m;
    nearest = &sample;
  });
  return nearest;
}

const LinePlace* FeatureIndex::LineNear(const Eigen::Vector3d& p, const Eigen::Vector3d& direction,
                                        double reach_m) const {
  const LinePlace* nearest = nullptr;
  double least_m = 1e9;
  lines_->ForEachNear(p, [&](int i) {
    const LinePlace& place = features_.lines[i];
    if (std::abs(place.direction_world.dot(direction)) < kParallel) return;
    const Eigen::Vector3d way = p - place.p_world;
    const double along_m = way.dot(place.direction_world);
    const double across_m = (way - along_m * place.direction_world).norm();
    if (across_m > reach_m || std::abs(along_m) > kBeside_m || across_m >= least_m) return;
    least_m = across_m;
    nearest = &place;
  });
  return nearest;
}

double MapAgreement::surfaces_m2() const {
  return kSurfaceSample_m2 *
         static_cast<double>(std::count(surfaces.begin(), surfaces.end(), Answer::kAgrees));
}

double MapAgreement::lines_m() const {
  return kLinePlace_m *
         static_cast<double>(std::count(lines.begin(), lines.end(), Answer::kAgrees));
}

double MapAgreement::agreeing_share() const {
  const auto count = [&](Answer answer) {
    return static_cast<double>(std::count(surfaces.begin(), surfaces.end(), answer));
  };
  const double agreeing = count(Answer::kAgrees);
  const double known = agreeing + count(Answer::kDiffers) + count(Answer::kContradicts);
  return known > 0 ? agreeing / known : 0;
}

double MapAgreement::contradiction() const {
  const auto count = [&](Answer answer) {
    return static_cast<double>(std::count(surfaces.begin(), surfaces.end(), answer));
  };
  const double contradicted = count(Answer::kContradicts) + first_contradicted;
  const double all = contradicted + count(Answer::kAgrees) + first_agreeing;
  return all > 0 ? contradicted / all : 0;
}

namespace {

Answer AnswerTo(const SurfaceSample& sample, const ComparedMap& map, const RigidTransform& T) {
  const Eigen::Vector3d p = T * sample.p_world, normal = T.rotation * sample.normal_world;
  if (map.index.SurfaceNear(p, normal, kSurface_m)) return Answer::kAgrees;
  if (!IsKnown(map.occupancy, p)) return Answer::kUnknown;
  return IsFreeAround(map.occupancy, p) ? Answer::kContradicts : Answer::kDiffers;
}

Answer AnswerTo(const LinePlace& place, const ComparedMap& map, const RigidTransform& T) {
  const Eigen::Vector3d p = T * place.p_world, direction = T.rotation * place.direction_world;
  if (map.index.LineNear(p, direction, kLine_m)) return Answer::kAgrees;
  if (!IsKnown(map.occupancy, p)) return Answer::kUnknown;
  return IsFreeAround(map.occupancy, p) ? Answer::kContradicts : Answer::kDiffers;
}

}  // namespace

MapAgreement Compare(const ComparedMap& first, const ComparedMap& second,
                     const RigidTransform& T_first_second) {
  MapAgreement agreement;
  for (const SurfaceSample& sample : second.features.surfaces) {
    agreement.surfaces.push_back(AnswerTo(sample, first, T_first_second));
  }
  for (const LinePlace& place : second.features.lines) {
    agreement.lines.push_back(AnswerTo(place, first, T_first_second));
  }
  const RigidTransform T_second_first = T_first_second.Inverse();
  for (const SurfaceSample& sample : first.features.surfaces) {
    const Answer answer = AnswerTo(sample, second, T_second_first);
    agreement.first_contradicted += answer == Answer::kContradicts;
    agreement.first_agreeing += answer == Answer::kAgrees;
  }
  return agreement;
}

Telling WhatTells(const MapAgreement& best, const MapAgreement& rival) {
  Telling telling;
  const auto add = [](const std::vector<Answer>& of_best, const std::vector<Answer>& of_rival,
                      double weight, Telling* sum) {
    for (std::size_t i = 0; i < of_best.size(); ++i) {
      if (of_best[i] == Answer::kUnknown || of_rival[i] == Answer::kUnknown) continue;
      const bool in_best = of_best[i] == Answer::kAgrees, in_rival = of_rival[i] == Answer::kAgrees;
      sum->for_best += in_best && !in_rival ? weight : 0;
      sum->for_rival += in_rival && !in_best ? weight : 0;
    }
  };
  add(best.surfaces, rival.surfaces, kSurfaceSample_m2, &telling);
  add(best.lines, rival.lines, kLinePlace_m, &telling);
  return telling;
}

namespace {

// What samples are off by besides what is known of them, and how many neighbours share that.
constexpr double kSurfaceSigma_m = 0.02, kLineSigma_m = 0.005;
constexpr double kSharedBy = 10;
constexpr int kLeastMatches = 30;
// Of the information on the transform: least against most, so that nothing slides.
constexpr double kLeastInformation = 1e-4;
constexpr double kTypicalReach_m = 5;  // by which turns are compared with shifts

// Normal equations in turn about z (about a centre) and translation.
class LevelEquations {
 public:
  LevelEquations(const RigidTransform& T, const Eigen::Vector3d& centre) : T_(T), centre_(centre) {}

  // Where a point of the second should be moved by `off` along a unit direction.
  void Add(const Eigen::Vector3d& p, const Eigen::Vector3d& along, double off_m, double sigma_m) {
    const double r = off_m / sigma_m;
    const double weight = 1 / ((1 + r * r) * sigma_m * sigma_m * kSharedBy);
    Eigen::Vector4d jacobian;
    const Eigen::Vector3d moved = Eigen::Vector3d::UnitZ().cross(p - centre_) / kTypicalReach_m;
    jacobian << along.dot(moved), along;
    information_ += weight * jacobian * jacobian.transpose();
    gradient_ += weight * off_m * jacobian;
  }

  void CountMatch() { ++matches_; }

  FitInformation Information() const {
    const Eigen::Vector4d scale(kTypicalReach_m, 1, 1, 1);
    return {centre_, scale.asDiagonal() * information_ * scale.asDiagonal()};
  }

  std::optional<RigidTransform> Solve() const {
    if (matches_ < kLeastMatches) return std::nullopt;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(information_,
                                                                Eigen::EigenvaluesOnly);
    if (!(solver.eigenvalues()(0) > kLeastInformation * solver.eigenvalues()(3))) {
      return std::nullopt;
    }
    const Eigen::Vector4d step = information_.ldlt().solve(gradient_);
    const RigidTransform about = LevelTransform(step(0) / kTypicalReach_m, Eigen::Vector3d::Zero());
    const Eigen::Vector3d t = about * (T_.translation - centre_) + centre_ + step.tail<3>();
    return RigidTransform((about.rotation * T_.rotation).normalized(), t);
  }

 private:
  const RigidTransform& T_;
  const Eigen::Vector3d centre_;
  Eigen::Matrix4d information_ = Eigen::Matrix4d::Zero();
  Eigen::Vector4d gradient_ = Eigen::Vector4d::Zero();
  int matches_ = 0;
};

void AddSurfaces(const FeatureIndex& first, const std::vector<SurfaceSample>& samples,
                 const RigidTransform& T, double gate_m, int max_samples,
                 LevelEquations* equations) {
  const std::size_t step = 1 + samples.size() / max_samples;
  for (std::size_t i = 0; i < samples.size(); i += step) {
    const Eigen::Vector3d p = T * samples[i].p_world;
    const auto* match = first.SurfaceNear(p, T.rotation * samples[i].normal_world, gate_m);
    if (!match) continue;
    const double off_m = match->normal_world.dot(match->p_world - p);
    equations->Add(p, match->normal_world, off_m, kSurfaceSigma_m);
    equations->CountMatch();
  }
}

void AddLines(const FeatureIndex& first, const std::vector<LinePlace>& places,
              const RigidTransform& T, double gate_m, int max_samples, LevelEquations* equations) {
  const std::size_t step = 1 + places.size() / max_samples;
  for (std::size_t i = 0; i < places.size(); i += step) {
    const Eigen::Vector3d p = T * places[i].p_world;
    const auto* match = first.LineNear(p, T.rotation * places[i].direction_world, gate_m);
    if (!match) continue;
    const Eigen::Vector3d& along = match->direction_world;
    const Eigen::Vector3d way = match->p_world - p, off = way - way.dot(along) * along;
    const double sigma_m = std::sqrt(std::pow(match->sigma_m, 2) + std::pow(places[i].sigma_m, 2) +
                                     kLineSigma_m * kLineSigma_m);
    const Eigen::Vector3d across = along.unitOrthogonal(), other = along.cross(across);
    equations->Add(p, across, across.dot(off), sigma_m);
    equations->Add(p, other, other.dot(off), sigma_m);
    equations->CountMatch();
  }
}

Eigen::Vector3d ComputeCentre(const AlignmentFeatures& features) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const SurfaceSample& surface : features.surfaces) sum += surface.p_world;
  for (const LinePlace& place : features.lines) sum += place.p_world;
  const std::size_t count = features.surfaces.size() + features.lines.size();
  return sum / static_cast<double>(std::max<std::size_t>(1, count));
}

}  // namespace

std::optional<AlignmentFit> FitAlignment(const FeatureIndex& first, const AlignmentFeatures& second,
                                         const RigidTransform& start,
                                         const AlignmentFitOptions& options) {
  AlignmentFit fit{start};
  const Eigen::Vector3d centre = ComputeCentre(second);
  for (int step = 0; step < options.steps; ++step) {
    const double share = static_cast<double>(step) / std::max(1, options.steps - 1);
    const double gate_m = options.from_m * std::pow(options.to_m / options.from_m, share);
    LevelEquations equations(fit.T_first_second, fit.T_first_second * centre);
    AddSurfaces(first, second.surfaces, fit.T_first_second, gate_m, options.max_samples,
                &equations);
    AddLines(first, second.lines, fit.T_first_second, gate_m, options.max_samples, &equations);
    const auto moved = equations.Solve();
    if (!moved) return std::nullopt;
    fit = {*moved, equations.Information()};
  }
  return fit;
}

}  // namespace slcmap::mapping
