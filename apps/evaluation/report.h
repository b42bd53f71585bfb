// What reports are made of: figures of nothing, and plots as SVG.
#pragma once

#include <spdlog/fmt/fmt.h>

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "data/core/math.h"

namespace slcmap::inline evaluation {

// Files that were compared, as the user named them; they stand at the head of tables and JSON.
struct ComparedFiles {
  std::string truth, mapped;
};

// Not a number; null in JSON.
inline constexpr double kNoFigure = std::numeric_limits<double>::quiet_NaN();

// A part of a whole; of none, no figure.
inline double ComputeShare(double part, double whole) {
  return whole > 0 ? part / whole : kNoFigure;
}
inline double ComputeShare(int64_t part, int64_t whole) {
  return ComputeShare(static_cast<double>(part), static_cast<double>(whole));
}

// The value below which a share of others lies; of none, no figure.
inline double QuantileFigure(std::vector<double> values, double share) {
  return values.empty() ? kNoFigure : Quantile(std::move(values), share);
}

// For tables: "-" where there is none.
inline std::string FigureText(double figure, int digits) {
  return std::isnan(figure) ? "-" : fmt::format("{:.{}f}", figure, digits);
}

// Line plots as SVG, for reports that need no plotting program.

enum class SvgStyle {
  kCurve,    // through all points
  kSegments  // each two points are the ends of a segment; one without length is a dot
};

struct SvgSeries {
  std::string label;
  std::string colour;  // of CSS, such as "#2060c0"
  std::vector<Eigen::Vector2d> points;
  SvgStyle style = SvgStyle::kCurve;
};

struct SvgPlot {
  std::string title, x_label, y_label;
  bool equal_scale = false;  // a metre is as long on both axes
  std::vector<SvgSeries> series;
};

// The distance between ticks, so that there are so many at most: 1, 2 or 5 times a power of ten.
double TickStep(double range, int most_ticks);

// The SVG document of a plot; the series may be empty. Of a curve of more than 30,000 points only
// those that show are drawn.
std::string DrawSvg(const SvgPlot& plot);

}  // namespace slcmap::evaluation
