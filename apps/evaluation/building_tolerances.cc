#include "apps/evaluation/building_tolerances.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace slcmap {
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

}  // namespace slcmap
