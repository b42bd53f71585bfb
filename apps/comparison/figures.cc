#include "apps/comparison/figures.h"

#include <algorithm>
#include <stdexcept>

namespace slcmap {

const std::vector<FigureInfo>& AllFigures() {
  using enum FigureGroup;
  static const std::vector<FigureInfo> figures = {
      {"ape_online_m", "APE online", "m", kTrajectory, 4, true, true},
      {"ape_final_m", "APE final", "m", kTrajectory, 4, true, true},
      {"ape_se3_final_m", "APE final, SE(3)", "m", kTrajectory, 4, true, true, false},
      {"rotation_final_deg", "rotation", "deg", kTrajectory, 3, true, true},
      {"rpe_1m_percent", "RPE 1 m", "%", kTrajectory, 3, true, true, false},
      {"rpe_5m_percent", "RPE 5 m", "%", kTrajectory, 3, true, true},
      {"rpe_10m_percent", "RPE 10 m", "%", kTrajectory, 3, true, true, false},
      {"loop_percent", "loop", "%", kTrajectory, 3, true, true},
      {"coverage_percent", "coverage", "%", kTrajectory, 1, false, true},
      {"edge_thickness_mm", "edges, thickness", "mm", kStraightness, 2},
      {"edge_thickness_beyond_mm", "edges, beyond true poses", "mm", kStraightness, 2, true, true},
      {"edge_apart_under_1s_mm", "edges, apart in 1 s", "mm", kStraightness, 2, true, false, false},
      {"edge_apart_over_30s_mm", "edges, apart after 30 s", "mm", kStraightness, 2},
      {"dispersion_deg", "directions", "deg", kStraightness, 3},
      {"orthogonality_deg", "off 90 deg", "deg", kStraightness, 3},
      {"mpv_mm2", "MPV of free points", "mm2", kStraightness, 1, true, false, false},
      {"mme_nats", "MME of free points", "nats", kStraightness, 3},
      {"mom_mm2", "MOM of free points", "mm2", kStraightness, 1, true, false, false},
      {"bend_4m_mm", "bent over 4 m", "mm", kStraightness, 1, true, true, false},
      {"bend_10m_mm", "bent over 10 m", "mm", kStraightness, 1, true, true},
      {"distance_95_mm", "face to face, 95 %", "mm", kStraightness, 1, true, true},
      {"line_precision_5cm_percent", "lines within 5 cm", "%", kLines, 1, false, true},
      {"line_recall_5cm_percent", "edges found within 5 cm", "%", kLines, 1, false, true},
      {"line_redundancy", "redundancy of lines", "", kLines, 2, true, true, false},
      {"dense_mpv_mm2", "MPV of the dense cloud", "mm2", kDenseMap, 2},
      {"dense_mme_nats", "MME of the dense cloud", "nats", kDenseMap, 3},
      {"dense_mom_mm2", "MOM of the dense cloud", "mm2", kDenseMap, 2},
      {"wall_gap_1m_mm", "gap under 1 m", "mm", kDenseMap, 1},
      {"wall_gap_4m_mm", "gap under 4 m", "mm", kDenseMap, 1},
      {"wall_gap_10m_mm", "gap under 10 m", "mm", kDenseMap, 1},
      {"wall_gap_15m_mm", "gap under 15 m", "mm", kDenseMap, 1},
      {"wall_lean_mm", "lean a storey", "mm", kDenseMap, 1},
      {"wall_distance_bound_mm", "face to face, +-95 %", "mm", kDenseMap, 1, true, false, false},
      {"cpu_ms_a_pair", "CPU a pair", "ms", kCost, 1},
      {"wall_s_a_second", "time a second", "s", kCost, 3, true, false, false},
      {"peak_memory_mib", "memory", "MiB", kCost, 0}};
  return figures;
}

const FigureInfo& FigureOf(const std::string& key) {
  const auto found = std::find_if(AllFigures().begin(), AllFigures().end(),
                                  [&](const FigureInfo& info) { return info.key == key; });
  if (found == AllFigures().end()) throw std::out_of_range("no figure " + key);
  return *found;
}

std::string GroupTitle(FigureGroup group) {
  switch (group) {
    case FigureGroup::kTrajectory:
      return "Trajectory, against the truth";
    case FigureGroup::kStraightness:
      return "Straightness, all with the same observations";
    case FigureGroup::kLines:
      return "Line map, against true edges";
    case FigureGroup::kDenseMap:
      return "Dense map: flatness, and walls as surveyors measure them";
    case FigureGroup::kCost:
      break;
  }
  return "Cost of odometry";
}

}  // namespace slcmap
