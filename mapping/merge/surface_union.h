// Points of two maps as those of one.
#pragma once

#include <vector>

#include "mapping/dense/dense_point.h"
#include "mapping/map.h"

namespace slcmap {

// One point for all that are in a voxel and face alike: their mean, weighted by what is known of
// each; of points that then lie along one normal within what is known of them the best known stays,
// so that a surface that both saw is one. Alignment_m is what the maps are off against each other.
// By voxel.
std::vector<DensePoint> UniteSurfaces(const std::vector<DensePoint>& first,
                                      const std::vector<DensePoint>& second, double alignment_m,
                                      double voxel_m);

struct UnitedPoints {
  std::vector<MapPoint> points;
  std::vector<MapPointObservation> observations;  // of those of either, whose tracks stay apart
};

// One point a voxel, weighted by what is known of each; observations are summed. By voxel.
UnitedPoints UnitePoints(const UnitedPoints& first, const UnitedPoints& second, double voxel_m);

}  // namespace slcmap
