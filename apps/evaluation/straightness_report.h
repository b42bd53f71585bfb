// Straightness as tables and JSON, beside the tolerances of buildings.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "apps/evaluation/straightness.h"

namespace slcmap::inline evaluation {

// DIN 18202 (finished walls), by interpolation between the lengths that it lists: the gap under a
// straightedge of a length (3, 5, 10, 20, 25 mm at 0.1, 1, 4, 10, 15 m).
double AllowedGap_m(double length_m);
// The deviation of an angle at the end of a leg (6, 8, 12, 16, 20 mm up to 1, 3, 6, 15, 30 m).
double AllowedAngle_m(double leg_m);
// The deviation of a clear width (16, 20, 24, 30 mm up to 3, 6, 15, 30 m).
double AllowedWidth_m(double width_m);

// What a bend of less than cannot be blamed on a map: over a length, real walls may have it.
inline double BuildingFloor_m(double length_m) { return AllowedGap_m(length_m); }

// The level of accuracy of the USIBD whose band holds an error (95 %): "LOA10" above 50 mm, LOA20
// to 50, LOA30 to 15, LOA40 to 5, LOA50 to 1 mm.
std::string LevelOfAccuracy(double error_95_m);

// Straightness as tables to read and as JSON.

// What is left of a thickness without that which the observations have with true poses: by squares,
// as errors add up that have nothing to do with each other.
double ThicknessBeyond_m(double thickness_m, double with_true_poses_m);

// Over the walls of a survey.
struct GapSummary {
  double length_m = 0;  // of the straightedge
  int64_t walls = 0;    // that it can be laid on
  int64_t within = 0;   // what DIN 18202 allows, of these
  double median_m = 0, worst_m = 0;
};

// Figures of nothing are kNoFigure.
struct SurveySummary {
  std::vector<GapSummary> gaps;  // by length; of no walls: kNoFigure
  int64_t leans = 0, distances = 0, angles = 0;
  double lean_median_m = 0, lean_worst_m = 0;  // over a storey
  double distance_bound_median_m = 0;          // 95 %
  double angle_worst_deg = 0;
  int64_t angles_within = 0;  // what DIN 18202 allows
  // Of the distances that the survey with true poses has too: the error that 95 % are below.
  std::optional<double> distance_error_95_m;
};

// `truth`: the survey of the same walls with true poses, or null.
SurveySummary Summarize(const Survey& survey, const Survey* truth);

// `truth`: the same with true poses, which is what the observations and the building have of their
// own; or null.
std::string StraightnessTable(const Straightness& straightness, const Straightness* truth);
nlohmann::ordered_json StraightnessJson(const Straightness& straightness,
                                        const Straightness* truth);

// Of a map's own points and walls.
std::string MapStraightnessTable(const MapStraightness& straightness);
nlohmann::ordered_json MapStraightnessJson(const MapStraightness& straightness);

}  // namespace slcmap::evaluation
