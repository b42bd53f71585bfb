// What a map by any system has of a laser scan, and how it is bent against that.
#pragma once

#include <optional>
#include <vector>

#include "apps/maps/map_alignment.h"
#include "apps/maps/map_straightness.h"

namespace slcmap::inline evaluation {

// Figures of nothing are kNoFigure.
struct AgreementScore {
  double tolerance_m = 0;
  double accuracy = 0;      // share of the map, by area or by length of lines, so near the truth
  double completeness = 0;  // of the truth, by area: of each place the share of what the map has
                            // there that is so near; of lines there is none
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
