#include "apps/evaluation/straightness_report.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "apps/evaluation/report.h"

namespace slcmap::inline evaluation {
namespace {

using Row = std::pair<double, double>;  // length [m], what is allowed [mm]

constexpr std::array<Row, 5> kGaps = {{{0.1, 3}, {1, 5}, {4, 10}, {10, 20}, {15, 25}}};
constexpr std::array<Row, 5> kAngles = {{{1, 6}, {3, 8}, {6, 12}, {15, 16}, {30, 20}}};
constexpr std::array<Row, 4> kWidths = {{{3, 16}, {6, 20}, {15, 24}, {30, 30}}};

// What is allowed up to a length; beyond the last, what the last allows.
template <size_t N>
double UpTo_m(const std::array<Row, N>& rows, double length_m) {
  const auto row =
      std::find_if(rows.begin(), rows.end(), [&](const Row& r) { return length_m <= r.first; });
  return 1e-3 * (row == rows.end() ? rows.back() : *row).second;
}

}  // namespace

double AllowedGap_m(double length_m) {
  if (length_m <= kGaps.front().first) return 1e-3 * kGaps.front().second;
  for (size_t i = 1; i < kGaps.size(); ++i) {
    const auto& [from_m, from_mm] = kGaps[i - 1];
    const auto& [to_m, to_mm] = kGaps[i];
    if (length_m > to_m) continue;
    return 1e-3 * (from_mm + (to_mm - from_mm) * (length_m - from_m) / (to_m - from_m));
  }
  return 1e-3 * kGaps.back().second;
}

double AllowedAngle_m(double leg_m) { return UpTo_m(kAngles, leg_m); }
double AllowedWidth_m(double width_m) { return UpTo_m(kWidths, width_m); }

std::string LevelOfAccuracy(double error_95_m) {
  constexpr std::array<std::pair<double, const char*>, 4> kBands = {
      {{0.001, "LOA50"}, {0.005, "LOA40"}, {0.015, "LOA30"}, {0.05, "LOA20"}}};
  if (std::isnan(error_95_m)) return "-";
  for (const auto& [most_m, name] : kBands) {
    if (error_95_m <= most_m) return name;
  }
  return "LOA10";
}

namespace {

using Json = nlohmann::ordered_json;

GapSummary SummarizeGaps(const Survey& survey, double length_m) {
  GapSummary summary;
  summary.length_m = length_m;
  std::vector<double> gaps_m;
  for (const SurveyedFace& wall : survey.walls) {
    for (const StraightedgeGap& gap : wall.gaps) {
      if (gap.length_m == length_m) gaps_m.push_back(gap.gap_m);
    }
  }
  summary.walls = static_cast<int64_t>(gaps_m.size());
  summary.within = std::count_if(gaps_m.begin(), gaps_m.end(),
                                 [&](double gap_m) { return gap_m <= AllowedGap_m(length_m); });
  summary.median_m = QuantileFigure(gaps_m, 0.5);
  summary.worst_m = QuantileFigure(gaps_m, 1);
  return summary;
}

std::optional<double> DistanceError95_m(const Survey& survey, const Survey& truth) {
  std::vector<double> errors_m;
  for (const FaceDistance& d : survey.distances) {
    for (const FaceDistance& t : truth.distances) {
      if (d.first == t.first && d.second == t.second) {
        errors_m.push_back(std::abs(d.distance_m - t.distance_m));
      }
    }
  }
  if (errors_m.empty()) return std::nullopt;
  return QuantileFigure(errors_m, 0.95);
}

std::string EdgeRows(const EdgeStraightness& edges, const EdgeStraightness* truth) {
  if (edges.edges == 0) return "edges     none with observations enough\n";
  std::string text =
      fmt::format("edges     {} of {} observations, each placed alone: {:.2f} mm thick (RMS)\n",
                  edges.edges, edges.observations, 1e3 * edges.thickness_m);
  if (truth && truth->edges > 0) {
    text += fmt::format("          {:.2f} mm with true poses, beyond that {:.2f} mm\n",
                        1e3 * truth->thickness_m,
                        1e3 * ThicknessBeyond_m(edges.thickness_m, truth->thickness_m));
  }
  text += "          apart, by the time between two observations:";
  for (const TimeGap& gap : edges.gaps) {
    if (gap.pairs == 0) continue;
    const std::string time = std::isinf(gap.to_s) ? fmt::format(">{:g}", gap.from_s)
                                                  : fmt::format("{:g}-{:g}", gap.from_s, gap.to_s);
    text += fmt::format("  {} s {:.2f} mm", time, 1e3 * gap.apart_m);
  }
  return text + "\n";
}

std::string DirectionRow(const std::optional<DirectionMetrics>& directions) {
  if (!directions) return "directions  no two edges at a right angle\n";
  std::string text = fmt::format(
      "directions  {:.3f} deg RMS off three axes at right angles ({:.0f} % of the length)",
      directions->dispersion_deg, 100 * directions->following);
  if (directions->orthogonality_deg) {
    text +=
        fmt::format("; axes fitted alone are {:.3f} deg off 90", *directions->orthogonality_deg);
  }
  return text + "\n";
}

std::string FlatnessRow(const std::optional<FlatnessMetrics>& flatness) {
  if (!flatness) return "flatness  too few points near each other\n";
  std::string text =
      fmt::format("flatness  MPV {:.2f} mm^2, MME {:.3f}", 1e6 * flatness->mpv_m2, flatness->mme);
  if (flatness->mom_m2) text += fmt::format(", MOM {:.2f} mm^2", 1e6 * *flatness->mom_m2);
  return text + fmt::format(" ({} of {} free points)\n", flatness->looked_at, flatness->points);
}

std::string GapRows(const SurveySummary& summary, const SurveySummary* added) {
  std::string text =
      "straightedge m   walls  median mm  worst mm  DIN 18202 mm  within  of the mapping mm\n";
  for (size_t i = 0; i < summary.gaps.size(); ++i) {
    const GapSummary& gap = summary.gaps[i];
    if (gap.walls == 0) continue;
    text += fmt::format("{:<14g}{:>8}{:>11.1f}{:>10.1f}{:>14.1f}{:>8}", gap.length_m, gap.walls,
                        1e3 * gap.median_m, 1e3 * gap.worst_m, 1e3 * AllowedGap_m(gap.length_m),
                        gap.within);
    text += added && added->gaps[i].walls > 0
                ? fmt::format("{:>19.1f}\n", 1e3 * added->gaps[i].worst_m)
                : fmt::format("{:>19}\n", "-");
  }
  return text;
}

// `added` and `truth` may be null.
std::string SurveyRows(const Survey& survey, const Survey* added_survey, const Survey* truth) {
  if (survey.walls.empty()) return "walls     none with points enough\n";
  const SurveySummary summary = Summarize(survey, truth);
  std::optional<SurveySummary> added;
  if (added_survey) added = Summarize(*added_survey, nullptr);
  std::string text = fmt::format("walls     {} faces\n", survey.walls.size());
  text += GapRows(summary, added ? &*added : nullptr);
  text += fmt::format("lean      {} mm a storey of {} m (median), {} mm (worst)\n",
                      FigureText(1e3 * summary.lean_median_m, 1), kSurveyStorey_m,
                      FigureText(1e3 * summary.lean_worst_m, 1));
  text += fmt::format("distances {} between faces, known to +-{} mm (95 %, median): {}\n",
                      summary.distances, FigureText(1e3 * summary.distance_bound_median_m, 1),
                      LevelOfAccuracy(summary.distance_bound_median_m));
  if (summary.distance_error_95_m) {
    text += fmt::format("          95 % within {:.1f} mm of those with true poses: {}\n",
                        1e3 * *summary.distance_error_95_m,
                        LevelOfAccuracy(*summary.distance_error_95_m));
  }
  text +=
      fmt::format("angles    {} between faces, at most {} deg off 90, {} within DIN 18202\n",
                  summary.angles, FigureText(summary.angle_worst_deg, 3), summary.angles_within);
  return text + fmt::format(
                    "floor     a real wall may bend by {:.0f} mm over 10 m: less is not the "
                    "mapping's\n",
                    1e3 * BuildingFloor_m(10));
}

Json EdgeJson(const EdgeStraightness& edges, const EdgeStraightness* truth) {
  Json json = {{"edges", edges.edges},
               {"observations", edges.observations},
               {"without_pose", edges.without_pose},
               {"thickness_m", edges.thickness_m}};
  json["thickness_beyond_true_poses_m"] =
      truth ? Json(ThicknessBeyond_m(edges.thickness_m, truth->thickness_m)) : Json();
  json["apart_by_time"] = Json::array();
  for (const TimeGap& gap : edges.gaps) {
    json["apart_by_time"].push_back({{"from_s", gap.from_s},
                                     {"to_s", std::isinf(gap.to_s) ? Json() : Json(gap.to_s)},
                                     {"pairs", gap.pairs},
                                     {"apart_m", gap.apart_m}});
  }
  return json;
}

Json DirectionJson(const DirectionMetrics& directions) {
  Json json = {{"dispersion_deg", directions.dispersion_deg}, {"following", directions.following}};
  json["orthogonality_deg"] =
      directions.orthogonality_deg ? Json(*directions.orthogonality_deg) : Json();
  return json;
}

Json FlatnessJson(const FlatnessMetrics& flatness) {
  Json json = {{"points", flatness.points},
               {"looked_at", flatness.looked_at},
               {"mpv_m2", flatness.mpv_m2},
               {"mme_nats", flatness.mme},
               {"on_planes", flatness.on_planes}};
  json["mom_m2"] = flatness.mom_m2 ? Json(*flatness.mom_m2) : Json();
  return json;
}

Json GapsJson(const std::vector<StraightedgeGap>& gaps) {
  Json json = Json::array();
  for (const StraightedgeGap& gap : gaps) {
    json.push_back({{"straightedge_m", gap.length_m}, {"gap_m", gap.gap_m}});
  }
  return json;
}

Json WallJson(const SurveyedFace& wall) {
  Json json = {{"wall", wall.wall},          {"points", wall.points}, {"length_m", wall.length_m},
               {"height_m", wall.height_m},  {"rms_m", wall.rms_m},   {"sigma_m", wall.sigma_m},
               {"gaps", GapsJson(wall.gaps)}};
  json["lean_m_a_storey"] = wall.lean_m ? Json(*wall.lean_m) : Json();
  return json;
}

Json SummaryJson(const SurveySummary& summary) {
  Json gaps = Json::array();
  for (const GapSummary& gap : summary.gaps) {
    if (gap.walls == 0) continue;
    gaps.push_back({{"straightedge_m", gap.length_m},
                    {"walls", gap.walls},
                    {"within_din_18202", gap.within},
                    {"allowed_m", AllowedGap_m(gap.length_m)},
                    {"median_m", gap.median_m},
                    {"worst_m", gap.worst_m}});
  }
  Json json = {{"gaps", gaps},
               {"lean_median_m", summary.lean_median_m},
               {"lean_worst_m", summary.lean_worst_m},
               {"distances", summary.distances},
               {"distance_bound_95_median_m", summary.distance_bound_median_m},
               {"angles", summary.angles},
               {"angle_worst_deg", summary.angle_worst_deg},
               {"angles_within_din_18202", summary.angles_within}};
  json["distance_error_95_m"] =
      summary.distance_error_95_m ? Json(*summary.distance_error_95_m) : Json();
  return json;
}

Json SurveyJson(const Survey& survey, const Survey* truth) {
  Json json = SummaryJson(Summarize(survey, truth));
  json["walls"] = Json::array();
  for (const SurveyedFace& wall : survey.walls) json["walls"].push_back(WallJson(wall));
  json["face_distances"] = Json::array();
  for (const FaceDistance& d : survey.distances) {
    json["face_distances"].push_back({{"walls", {d.first, d.second}},
                                      {"distance_m", d.distance_m},
                                      {"bound_95_m", d.bound_95_m},
                                      {"allowed_m", AllowedWidth_m(d.distance_m)}});
  }
  return json;
}

}  // namespace

double ThicknessBeyond_m(double thickness_m, double with_true_poses_m) {
  const double squares = thickness_m * thickness_m - with_true_poses_m * with_true_poses_m;
  return std::isnan(squares) ? kNoFigure : std::sqrt(std::max(0.0, squares));
}

SurveySummary Summarize(const Survey& survey, const Survey* truth) {
  SurveySummary summary;
  for (const double length_m : kSurveyStraightedges_m) {
    summary.gaps.push_back(SummarizeGaps(survey, length_m));
  }
  std::vector<double> leans_m, bounds_m, angles_deg;
  for (const SurveyedFace& wall : survey.walls) {
    if (wall.lean_m) leans_m.push_back(*wall.lean_m);
  }
  for (const FaceDistance& d : survey.distances) {
    if (!std::isnan(d.bound_95_m)) bounds_m.push_back(d.bound_95_m);
  }
  for (const FaceAngle& angle : survey.angles) {
    angles_deg.push_back(angle.off_deg);
    summary.angles_within += angle.off_m <= AllowedAngle_m(angle.leg_m);
  }
  summary.leans = static_cast<int64_t>(leans_m.size());
  summary.distances = static_cast<int64_t>(survey.distances.size());
  summary.angles = static_cast<int64_t>(angles_deg.size());
  summary.lean_median_m = QuantileFigure(leans_m, 0.5);
  summary.lean_worst_m = QuantileFigure(leans_m, 1);
  summary.distance_bound_median_m = QuantileFigure(bounds_m, 0.5);
  summary.angle_worst_deg = QuantileFigure(angles_deg, 1);
  if (truth) summary.distance_error_95_m = DistanceError95_m(survey, *truth);
  return summary;
}

std::string StraightnessTable(const Straightness& straightness, const Straightness* truth) {
  return EdgeRows(straightness.edges, truth ? &truth->edges : nullptr) +
         DirectionRow(straightness.directions) + FlatnessRow(straightness.flatness) +
         SurveyRows(straightness.survey, straightness.added ? &*straightness.added : nullptr,
                    truth ? &truth->survey : nullptr);
}

Json StraightnessJson(const Straightness& straightness, const Straightness* truth) {
  Json json;
  json["edges"] = EdgeJson(straightness.edges, truth ? &truth->edges : nullptr);
  json["directions"] = straightness.directions ? DirectionJson(*straightness.directions) : Json();
  json["flatness"] = straightness.flatness ? FlatnessJson(*straightness.flatness) : Json();
  json["survey"] = SurveyJson(straightness.survey, truth ? &truth->survey : nullptr);
  json["added_by_mapping"] =
      straightness.added ? SummaryJson(Summarize(*straightness.added, nullptr)) : Json();
  return json;
}

std::string MapStraightnessTable(const MapStraightness& straightness) {
  return FlatnessRow(straightness.flatness) + SurveyRows(straightness.survey, nullptr, nullptr);
}

Json MapStraightnessJson(const MapStraightness& straightness) {
  Json json;
  json["flatness"] = straightness.flatness ? FlatnessJson(*straightness.flatness) : Json();
  json["survey"] = SurveyJson(straightness.survey, nullptr);
  return json;
}

}  // namespace slcmap::evaluation
