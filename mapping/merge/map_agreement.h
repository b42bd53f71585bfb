// What two maps say of each other where both have looked.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "mapping/merge/alignment_features.h"
#include "mapping/occupancy_map.h"

namespace slcmap {

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

MapAgreement Compare(const ComparedMap& first, const ComparedMap& second,
                     const RigidTransform& T_first_second);

// What tells two places of the second map apart: the samples that agree at the one, while the first
// map has looked where the other puts them and has nothing like them there. Metres of lines and
// square metres of surfaces.
struct Telling {
  double for_best = 0, for_rival = 0;
};
Telling WhatTells(const MapAgreement& best, const MapAgreement& rival);

}  // namespace slcmap
