#include "apps/compare/figures.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace slcmap::inline evaluation {

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
      {"line_precision_5cm_percent", "lines within 5 cm", "%", kLines, 1, false, true},
      {"line_recall_5cm_percent", "edges found within 5 cm", "%", kLines, 1, false, true},
      {"line_redundancy", "redundancy of lines", "", kLines, 2, true, true, false},
      {"cpu_ms_a_pair", "CPU a pair", "ms", kCost, 1},
      {"wall_s_a_second", "time a second", "s", kCost, 3, true, false, false},
      {"peak_memory_mib", "memory", "MiB", kCost, 0}};
  return figures;
}

const FigureInfo& FindFigure(const std::string& key) {
  const auto found = std::find_if(AllFigures().begin(), AllFigures().end(),
                                  [&](const FigureInfo& info) { return info.key == key; });
  if (found == AllFigures().end()) throw std::out_of_range("no figure " + key);
  return *found;
}

std::string DescribeFigure(const std::string& key) {
  static const std::map<std::string, const char*> meanings = {
      {"ape_online_m",
       "RMSE of the positions as they were known at once, after turning and moving the path onto "
       "the truth by translation and yaw (posyaw)"},
      {"ape_final_m",
       "RMSE of the final positions after alignment by translation and yaw (posyaw)"},
      {"ape_se3_final_m", "the same after alignment by translation and full rotation (SE(3))"},
      {"rotation_final_deg", "RMSE of the final orientations after the alignment by posyaw"},
      {"rpe_1m_percent", "RMSE of the motion over 1 m of the path, in percent of it"},
      {"rpe_5m_percent", "RMSE of the motion over 5 m of the path, in percent of it"},
      {"rpe_10m_percent", "RMSE of the motion over 10 m of the path, in percent of it"},
      {"loop_percent",
       "error of the motion from the first pose to the last, in percent of the path, where the "
       "truth ends at its start"},
      {"coverage_percent", "share of all images, the first ones too, that have a pose"},
      {"edge_thickness_mm",
       "RMS distance of single stereo observations of an edge from the one line through them"},
      {"edge_thickness_beyond_mm",
       "what of that is left without what the same observations have with true poses, by squares"},
      {"edge_apart_under_1s_mm",
       "distance between observations of one edge that are less than 1 s apart"},
      {"edge_apart_over_30s_mm",
       "distance between observations of one edge that are more than 30 s apart"},
      {"dispersion_deg", "RMS angle of the lines to the three axes fitted to them"},
      {"orthogonality_deg", "how far axes that are fitted alone are from a right angle"},
      {"mpv_mm2", "mean plane variance of stereo points that no plane was fitted to"},
      {"mme_nats", "mean map entropy of the same points: less is crisper"},
      {"mom_mm2", "mean plane variance over mutually orthogonal planes of the same points"},
      {"line_precision_5cm_percent",
       "share of the mapped length with a true edge within 5 cm and 10 degrees"},
      {"line_recall_5cm_percent", "share of the length of seen edges with a line that near"},
      {"line_redundancy", "mapped length over that of the edges found: 1 is ideal"},
      {"cpu_ms_a_pair", "processor time of the odometry for a pair of images, of all threads"},
      {"wall_s_a_second", "time that passed for a second of the recording: 1 is real time"},
      {"peak_memory_mib", "most memory that the odometry had at once"}};
  return meanings.at(key);
}

std::string GroupTitle(FigureGroup group) {
  switch (group) {
    case FigureGroup::kTrajectory:
      return "Trajectory, against the truth";
    case FigureGroup::kStraightness:
      return "Straightness, all with the same observations";
    case FigureGroup::kLines:
      return "Line map, against true edges";
    case FigureGroup::kCost:
      break;
  }
  return "Cost of odometry";
}

namespace {

bool IsBetter(const Ranked& a, const Ranked& b, bool less_is_better) {
  return less_is_better ? IsBelow(a.spread, b.spread) : IsBelow(b.spread, a.spread);
}

std::string Listed(const std::vector<std::string>& names) {
  std::string text;
  for (size_t i = 0; i < names.size(); ++i) {
    text += i == 0 ? "" : i + 1 == names.size() ? " and " : ", ";
    text += names[i];
  }
  return text;
}

}  // namespace

Spread ComputeSpread(const std::vector<double>& values) {
  Spread spread;
  spread.count = static_cast<int>(values.size());
  if (values.empty()) return spread;
  for (const double value : values) spread.mean += value / spread.count;
  if (values.size() < 2) return spread;
  double squares = 0;
  for (const double value : values) squares += (value - spread.mean) * (value - spread.mean);
  spread.deviation = std::sqrt(squares / (spread.count - 1));
  return spread;
}

std::string SpreadText(const Spread& spread, int digits) {
  if (spread.count == 0) return "-";
  if (spread.count == 1) return fmt::format("{:.{}f}", spread.mean, digits);
  return fmt::format("{:.{}f} +- {:.{}f}", spread.mean, digits, spread.deviation, digits);
}

bool IsBelow(const Spread& a, const Spread& b) {
  if (a.count < 2 || b.count < 2) return false;
  const double error =
      std::sqrt(a.deviation * a.deviation / a.count + b.deviation * b.deviation / b.count);
  return b.mean - a.mean > 2 * error && b.mean > a.mean;
}

std::optional<size_t> FindBestMethod(const std::vector<Ranked>& methods, bool less_is_better) {
  if (methods.size() < 2) return std::nullopt;
  for (size_t i = 0; i < methods.size(); ++i) {
    bool best = true;
    for (size_t j = 0; j < methods.size(); ++j) {
      best = best && (i == j || IsBetter(methods[i], methods[j], less_is_better));
    }
    if (best) return i;
  }
  return std::nullopt;
}

std::string OrderInWords(const std::vector<Ranked>& methods, bool less_is_better) {
  const auto is_single = [](const Ranked& m) { return m.spread.count < 2; };
  if (methods.size() < 2) return "nothing to compare with";
  if (std::count_if(methods.begin(), methods.end(), is_single) + 1 >=
      static_cast<std::ptrdiff_t>(methods.size())) {
    return "single runs: nothing says how far they scatter, so no order";
  }
  std::vector<Ranked> sorted = methods;
  std::stable_sort(sorted.begin(), sorted.end(), [&](const Ranked& a, const Ranked& b) {
    return less_is_better ? a.spread.mean < b.spread.mean : b.spread.mean < a.spread.mean;
  });
  std::vector<std::string> parts;
  for (const Ranked& better : sorted) {
    std::vector<std::string> worse;
    for (const Ranked& other : sorted) {
      if (IsBetter(better, other, less_is_better)) worse.push_back(other.name);
    }
    if (!worse.empty()) parts.push_back(better.name + " before " + Listed(worse));
  }
  return parts.empty() ? "the spread bears no order" : fmt::format("{}", fmt::join(parts, "; "));
}

}  // namespace slcmap::evaluation
