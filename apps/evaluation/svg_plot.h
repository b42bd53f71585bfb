// Line plots as SVG, for reports that need no plotting program.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace slcmap {

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

// The SVG document of a plot; the series may be empty. Of a curve of more than 30,000 points only
// those that show are drawn.
std::string DrawSvg(const SvgPlot& plot);

}  // namespace slcmap
