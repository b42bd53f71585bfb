// Straightness as tables to read and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "apps/evaluation/straightness.h"

namespace slcmap {

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
SurveySummary Summarize(const Survey& survey, const Survey* truth, const SurveyOptions& options);

// `truth`: the same with true poses, which is what the observations and the building have of their
// own; or null.
std::string StraightnessTable(const Straightness& straightness, const Straightness* truth,
                              const StraightnessOptions& options);
nlohmann::ordered_json StraightnessJson(const Straightness& straightness, const Straightness* truth,
                                        const StraightnessOptions& options);

// Of a map's own points and walls.
std::string MapStraightnessTable(const MapStraightness& straightness,
                                 const StraightnessOptions& options);
nlohmann::ordered_json MapStraightnessJson(const MapStraightness& straightness,
                                           const StraightnessOptions& options);

}  // namespace slcmap
