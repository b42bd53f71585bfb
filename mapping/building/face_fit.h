// One face fitted to samples: a line in the plan. Offsets in strips along a heading, and chains of
// them from strip to strip.
#pragma once

#include <set>
#include <utility>
#include <vector>

#include "mapping/building/faces.h"

namespace slcmap::inline mapping {

// Samples along a heading: n = heading . p, s along the direction square to it (to its left).
struct HeadedSample {
  double n = 0, s = 0, z = 0;
  double sigma_m = 0;
  bool has_normal = false;
  Eigen::Vector2d normal = Eigen::Vector2d::Zero();
  int index = 0;  // into the samples
};

// The straight line n = offset + slope (s - middle), with its uncertainty.
struct FaceFit {
  double middle_m = 0, offset_m = 0, slope = 0;
  double offset_sigma_m = 0, slope_sigma = 0;
  double from_m = 0, to_m = 0;

  double At(double s) const { return offset_m + slope * (s - middle_m); }
  double SigmaAt(double s) const;
};

// What is measured of a face within a strip.
struct StripMean {
  double s = 0, n = 0, variance_m2 = 0;
};

inline constexpr double kStrip_m = 0.2;

// Of least squares over strips, no strip better than the bending of a wall lets it be; the
// uncertainties count deviations as alike along kBuildingBendLength_m. At least one strip.
FaceFit FitStrips(const std::vector<StripMean>& strips);

// Fits a line again to the samples near it: those within its gate, beside its strips, of its side.
// Samples are sorted by s. `used` gets the samples that it is made of. False: too little is left.
bool Refit(const std::vector<HeadedSample>& samples, double tolerance_cosine, double gate_m,
           const BuildingOptions& options, FaceFit* fit, std::vector<int>* used);

// Cells of 10 cm, as area.
double CellArea(const std::set<std::pair<int, int>>& cells);
std::pair<int, int> FindAreaCell(double s, double z);

// Chains of offsets that go on from strip to strip, each as the strips of a face to be fitted.
// Samples of one side of a heading, sorted by s.
std::vector<std::vector<StripMean>> FollowOffsets(const std::vector<HeadedSample>& samples,
                                                  const BuildingOptions& options);

}  // namespace slcmap::mapping
