// How flat a cloud is where it is flat, without any truth.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "data/progress.h"

namespace slcmap {

struct FlatnessOptions {
  double radius_m = 0.3;      // of a point's neighbourhood
  int min_neighbours = 8;     // within it, the point included
  int max_points = 20000;     // whose neighbourhoods are looked at, evenly over the cloud
  int max_neighbours = 400;   // of one point, evenly over them
  double max_angle_deg = 10;  // of a normal from an axis, for MOM
  // A neighbourhood is of a plane where its least variance is below this share of the next.
  double max_flatness = 0.1;
  void Check() const;  // throws ConfigError
};

// A. Kornilova and G. Ferrer, "Be your own benchmark: no-reference trajectory metric on
// registered point clouds", ECMR 2021; the first two go back to D. Droeschel and S. Behnke (2014).
struct FlatnessMetrics {
  int64_t points = 0;            // of the cloud
  int64_t looked_at = 0;         // that have neighbours enough
  double mpv_m2 = 0;             // mean plane variance: mean of the neighbourhoods' least variances
  double mme = 0;                // mean map entropy: of 0.5 ln det(2 pi e covariance), in nats
  int64_t on_planes = 0;         // points on mutually orthogonal planes
  std::optional<double> mom_m2;  // MPV over these; nothing where there are none

  double thickness_m() const;  // square root of MPV
};

// Nothing where no point has neighbours enough. Throws StoppedError when progress says so.
std::optional<FlatnessMetrics> MeasureFlatness(const std::vector<Eigen::Vector3d>& points,
                                               const FlatnessOptions& options,
                                               const Progress& progress = {});

}  // namespace slcmap
