// Where a map by any system lies in the world of a laser scan, what it has of that, and how it is
// bent against it.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "apps/maps/map_straightness.h"
#include "apps/maps/surface_map.h"
#include "data/core/rigid_transform.h"

namespace slcmap::inline evaluation {

// Places of a map with the normals of its surfaces, or with the directions of its lines.
struct MapSamples {
  bool are_lines = false;
  std::vector<Eigen::Vector3d> places, directions;
  BuildingAxes axes;
};
MapSamples SampleSurfaces(const SurfaceMap& map);
MapSamples SampleLines(const std::vector<PlySegment>& lines);

// What single precision leaves of the coordinates of a building: distances that are as large as a
// limit are within it.
inline constexpr double kRounding_m = 1e-5;

// A scan that maps are laid on.
struct TrueScan {
  explicit TrueScan(std::vector<Eigen::Vector3d> points);

  const SurfaceMap map;
  const NearPlanes planes;
  const MapSamples samples;
};

struct ScanPlacement {
  RigidTransform T_truth_map;
  double overlap = 0;  // share of the map's samples within 10 cm of the truth
  double rival = 0;    // the same at the best other place; 0 where none was tried
};

// Lays the map on the truth, from where it is or, where that does not fit, from any place at which
// their walls agree, by least squares on planes. With `as_it_is` it stays where it is. Throws
// DataError, naming the map, where it is in other units or does not lie on the truth.
ScanPlacement PlaceOnTruth(const std::string& name, const MapSamples& map, const TrueScan& truth,
                           bool as_it_is);

// Throws DataError where no building is so large or so small in metres.
void RefuseOtherUnits(const std::string& name, const std::vector<Eigen::Vector3d>& places);

// What a map by any system has of a laser scan, and how it is bent against that.

// Figures of nothing are kNoFigure.
struct AgreementScore {
  double tolerance_m = 0;
  double accuracy = 0;      // share of the map, by area or by length of lines, so near the truth
  double completeness = 0;  // of the truth, by area: where what the map has beside it is so near;
                            // of lines there is none
  double f = 0;
};

struct TruthAgreement {
  ScanPlacement placement;
  std::vector<AgreementScore> scores;  // at 2, 5 and 10 cm
  double rms_m = 0;                    // of what is within 10 cm
  // Walls against the truth's own: what the building bends is not in it.
  std::vector<StraightedgeFigures> bends;
  double whole_bend_m = 0;  // the largest along any wall, from end to end
};

// `filled`: points laid on planes, which count for what the truth has. `map` may be null: lines
// only.
struct MapOnScan {
  const SurfaceMap* map = nullptr;
  const std::vector<FoundFace>* faces = nullptr;
  const std::vector<Eigen::Vector3d>* filled = nullptr;
  const std::vector<PlySegment>* lines = nullptr;
  ScanPlacement placement;
};
TruthAgreement MeasureAgreement(const MapOnScan& placed, const TrueScan& truth);

}  // namespace slcmap::evaluation
