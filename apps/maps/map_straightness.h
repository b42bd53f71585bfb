// How straight, flat and square maps by any system are, by their surfaces and by their lines.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "apps/evaluation/edge_straightness.h"
#include "apps/maps/straightedge.h"
#include "apps/maps/wall_finder.h"
#include "data/core/progress.h"

namespace slcmap::inline evaluation {

// Over all walls or edges, each by the length that the straightedge was laid on.
struct StraightedgeFigures {
  double length_m = 0;
  int64_t pieces = 0;  // walls or edges that are long enough
  double laid_m = 0;
  double rms_m = 0;  // the score that maps are ranked by
  double gap_median_m = 0, gap_worst_m = 0;
  int64_t within_din = 0;  // what DIN 18202 lets pass, of the pieces
};
std::vector<StraightedgeFigures> Summarize(
    const std::vector<std::vector<LaidStraightedge>>& pieces);

// Figures of nothing are kNoFigure.
struct WallStraightness {
  int64_t walls = 0;
  double length_m = 0, area_m2 = 0;
  std::vector<StraightedgeFigures> straightedges;
  double lean_rms_m = 0;     // over a storey, by area, from the map's own up
  double tilt_deg = 0;       // of its z against that
  int64_t angles = 0;        // between walls at about a right angle
  double angle_rms_deg = 0;  // from 90 degrees, by the shorter wall
  // How thick surfaces are, from neighbourhoods of 15 cm spread evenly over them.
  double thickness_m = 0;  // root of the mean plane variance (MPV)
  double mme = 0;          // mean map entropy
};
WallStraightness MeasureWalls(const SurfaceMap& map, const BuildingAxes& axes,
                              const std::vector<FoundFace>& faces);

struct LineStraightness {
  int64_t pieces = 0;
  double length_m = 0;  // of all pieces
  double edges_m = 0;   // of what they cover, duplicates once
  int64_t edges = 0;    // assembled of pieces that go on in each other
  std::vector<StraightedgeFigures> straightedges;
  std::optional<DirectionMetrics> directions;  // of stretches of a metre
};
LineStraightness MeasureLines(const std::vector<PlySegment>& lines);

}  // namespace slcmap::evaluation
