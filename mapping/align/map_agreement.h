// The level transform that brings one map onto another, what the two say of each other where both
// have looked, and the samples and headings that they are compared by.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "data/core/rigid_transform.h"
#include "mapping/map/map.h"
#include "mapping/map/occupancy_map.h"

namespace slcmap::inline mapping {

// The mean of the dense points of a small cube that face alike.
struct SurfaceSample {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal_world = Eigen::Vector3d::UnitZ();
};

// A place on a line that stands for a stretch of it.
struct LinePlace {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction_world = Eigen::Vector3d::UnitZ();  // unit, either way round
  double sigma_m = 0;                                          // across it
};

inline constexpr double kSurfaceSample_m = 0.2, kLinePlace_m = 0.1;

struct AlignmentFeatures {
  std::vector<SurfaceSample> surfaces;  // each for a square of kSurfaceSample_m
  std::vector<LinePlace> lines;         // each for kLinePlace_m
  // Directions about z, in [0, 90) degrees, that level lines and upright surfaces follow or are at
  // right angles to; the strongest first.
  std::vector<double> headings_rad;
};

// Deterministic. Marks count as lines do: they are as true.
AlignmentFeatures FindFeatures(const MapResult& map);

// Those of some lines, or samples of surfaces, alone.
AlignmentFeatures FindFeatures(const std::vector<MapLine>& lines);
AlignmentFeatures FindFeatures(std::vector<SurfaceSample> surfaces);

// The turn about z by an angle, then a translation.
RigidTransform LevelTransform(double yaw_rad, const Eigen::Vector3d& translation);
double ComputeYaw(const RigidTransform& transform);

// The samples of a map by where they are.
class FeatureIndex {
 public:
  explicit FeatureIndex(const AlignmentFeatures& features);
  ~FeatureIndex();

  // The nearest sample that faces alike, or runs alike, within a distance across it of reach_m and
  // not much farther along; null where there is none.
  const SurfaceSample* SurfaceNear(const Eigen::Vector3d& p, const Eigen::Vector3d& normal,
                                   double reach_m) const;
  const LinePlace* LineNear(const Eigen::Vector3d& p, const Eigen::Vector3d& direction,
                            double reach_m) const;

 private:
  struct Cells;
  const AlignmentFeatures& features_;
  std::unique_ptr<Cells> surfaces_, lines_;
};

// What the first map says of a sample of the second.
enum class Answer : uint8_t { kUnknown, kAgrees, kDiffers, kContradicts };

struct MapAgreement {
  std::vector<Answer> surfaces, lines;  // by sample of the second map
  // Surfaces of the first in the second's free space, of those that this one knows.
  int first_contradicted = 0, first_agreeing = 0;

  double surfaces_m2() const;     // that agree
  double lines_m() const;         // that agree
  double agreeing_share() const;  // of the surfaces of the second that the first knows
  double contradiction() const;   // share, of both, of surfaces that agree or contradict
};

// A map as it is compared: what stands in it, and where it knows that nothing does.
struct ComparedMap {
  const AlignmentFeatures& features;
  const FeatureIndex& index;
  const OccupancyMap& occupancy;
};

// What of a map is compared, without the rest of it.
class ComparableMap {
 public:
  explicit ComparableMap(MapResult map)
      : features_(FindFeatures(map)), index_(features_), occupancy_(std::move(map.occupancy)) {}
  ComparableMap(const ComparableMap&) = delete;
  ComparableMap& operator=(const ComparableMap&) = delete;

  ComparedMap Get() const { return {features_, index_, occupancy_}; }

 private:
  const AlignmentFeatures features_;
  const FeatureIndex index_;
  const OccupancyMap occupancy_;
};

MapAgreement Compare(const ComparedMap& first, const ComparedMap& second,
                     const RigidTransform& T_first_second);

// What tells two places of the second map apart: the samples that agree at the one, while the first
// map has looked where the other puts them and has nothing like them there. Metres of lines and
// square metres of surfaces.
struct Telling {
  double for_best = 0, for_rival = 0;
};
Telling WhatTells(const MapAgreement& best, const MapAgreement& rival);

// The level transform that brings one map onto another.

// How well it is known: inverse covariance of the turn about z, about a point of the first map, and
// of that point's translation.
struct FitInformation {
  Eigen::Vector3d centre_first = Eigen::Vector3d::Zero();
  Eigen::Matrix4d of_turn_and_shift = Eigen::Matrix4d::Zero();
};

struct AlignmentFit {
  RigidTransform T_first_second;
  FitInformation information = {};  // about the last step
};

struct AlignmentFitOptions {
  double from_m = 0.4, to_m = 0.06;  // across: what is matched, in the first step and in the last
  int steps = 12;
  int max_samples = 4000;  // of each kind, that are looked at
};

// Least squares over turn about z and translation, of distances from the nearest samples of the
// first: of surfaces along their normals, of lines across them, weighted by what is known of both,
// with Cauchy's loss. Matches are looked for again in each step. Nothing where they do not
// determine the transform.
std::optional<AlignmentFit> FitAlignment(const FeatureIndex& first, const AlignmentFeatures& second,
                                         const RigidTransform& start,
                                         const AlignmentFitOptions& options);

}  // namespace slcmap::mapping
