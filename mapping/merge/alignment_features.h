// What maps are compared by: samples of surfaces and lines, and the headings that these follow.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/rigid_transform.h"
#include "mapping/map.h"

namespace slcmap {

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
AlignmentFeatures FeaturesOf(const MapResult& map);

// The turn about z by an angle, then a translation.
RigidTransform LevelTransform(double yaw_rad, const Eigen::Vector3d& translation);
double YawOf(const RigidTransform& transform);

}  // namespace slcmap
