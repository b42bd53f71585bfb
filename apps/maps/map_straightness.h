// How straight, flat and square maps by any system are, by their surfaces and by their lines.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "apps/evaluation/straightness.h"
#include "apps/maps/surface_map.h"

namespace slcmap::inline evaluation {

// A place of a wall or an edge beside the plane or line fitted to it.
struct StraightSample {
  double along_m = 0, up_m = 0;
  double off_m = 0;
  double weight = 1;  // the share of the wall or edge that it stands for
};

// Of all places that a straightedge of a length can be laid at.
struct LaidStraightedge {
  double length_m = 0;
  double laid_m = 0;  // length of the wall or edge that it was laid on
  double rms_m = 0;   // of samples from the plane or line that fits best beneath it
  double gap_m = 0;   // the largest beneath it, without what noise alone makes
};

inline constexpr double kMapStraightedges_m[] = {1, 4, 10};

// DIN 18202 (finished walls), by interpolation between the lengths that it lists: the gap under a
// straightedge of a length (3, 5, 10, 20, 25 mm at 0.1, 1, 4, 10, 15 m). A real wall may bend by as
// much: less cannot be blamed on a map.
double AllowedGap_m(double length_m);

// By length, those that can be laid. Samples in any order; noise_m: standard deviation of one.
std::vector<LaidStraightedge> LayStraightedges(std::vector<StraightSample> samples, double noise_m);

// The standard deviation of samples from a curve through their means, as the median has it.
double RobustNoise_m(const std::vector<StraightSample>& samples, double step_m);

// The largest gap under a straightedge as long as the whole; 0 where it is too short.
double WholeGap_m(std::vector<StraightSample> samples, double noise_m);

// Walls of a cloud by another system: connected upright surfaces, however they bend.

// One face, with axes of its own: along (level), upwards, and its normal.
struct FoundFace {
  Eigen::Vector3d middle, along, upwards, normal;
  double length_m = 0, height_m = 0;
  double noise_m = 0;  // standard deviation of a point
  // Points from the plane that fits best; what stands before it is left out. A sample counts by the
  // area that it stands for.
  std::vector<StraightSample> samples;
  std::vector<int32_t> points;  // by sample: of the map
};

// Deterministic; the longest first. `up`: unit.
std::vector<FoundFace> FindFaces(const SurfaceMap& map, const Eigen::Vector3d& up);

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
