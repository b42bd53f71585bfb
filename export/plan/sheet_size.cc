#include "export/plan/sheet_size.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "data/error.h"

namespace slcmap {
namespace {

using Eigen::Vector2d;

struct Paper {
  const char* name;
  double width_mm, height_mm;
};
constexpr std::array<Paper, 5> kPapers = {
    {{"A4", 297, 210}, {"A3", 420, 297}, {"A2", 594, 420}, {"A1", 841, 594}, {"A0", 1189, 841}}};
constexpr size_t kA2 = 2, kA0 = 4;

// What the chains of dimensions take at each side, and clear space around them.
constexpr double kChains_mm = 18, kClear_mm = 3;

SheetFormat FormatOf(const Paper& paper, int scale) {
  return {scale, paper.name, {paper.width_mm, paper.height_mm}};
}

std::optional<SheetFormat> Smallest(const Vector2d& extent_m, int scale, size_t largest) {
  const Vector2d needed_mm =
      extent_m * 1000 / scale + Vector2d::Constant(2 * (kChains_mm + kClear_mm));
  for (size_t i = 0; i <= largest; ++i) {
    const SheetFormat format = FormatOf(kPapers[i], scale);
    if ((needed_mm.array() <= format.Area_mm().array()).all()) return format;
  }
  return std::nullopt;
}

// The first of 1:100, 1:200, 1:500, 1:1000, ... that a sheet holds.
SheetFormat Chosen(const Vector2d& extent_m) {
  for (int tens = 100;; tens *= 10) {
    for (const int step : {1, 2, 5}) {
      if (const auto format = Smallest(extent_m, step * tens, kA0)) return *format;
    }
  }
}

}  // namespace

Vector2d SheetFormat::Corner_mm() const {
  return {kSheetBorder_mm, kSheetBorder_mm + kTitleBlock_mm};
}

Vector2d SheetFormat::Area_mm() const {
  return size_mm - Corner_mm() - Vector2d::Constant(kSheetBorder_mm);
}

Vector2d SheetFormat::Middle_mm() const { return Corner_mm() + 0.5 * Area_mm(); }

SheetFormat ChooseFormat(const Vector2d& extent_m, const PlanOptions& options) {
  options.Check();
  constexpr double kMost_m = 1e6;
  if (!(extent_m.array() <= kMost_m).all()) {
    throw DataError(fmt::format("plan: found a building of {} m by {} m, expected at most {} m",
                                extent_m.x(), extent_m.y(), kMost_m));
  }
  if (options.scale > 0) {
    if (const auto format = Smallest(extent_m, options.scale, kA0)) return *format;
    throw ConfigError(fmt::format("plan scale: found 1:{}, which A0 does not hold, expected 1:{}",
                                  options.scale, Chosen(extent_m).scale));
  }
  if (const auto format = Smallest(extent_m, 50, kA2)) return *format;
  return Chosen(extent_m);
}

}  // namespace slcmap
