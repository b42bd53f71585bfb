#include "export/plan/dimension.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>

namespace slcmap {
namespace {

using Eigen::Vector2d;

Vector2d LeftOf(const Vector2d& direction) { return {-direction.y(), direction.x()}; }

// A short stroke across the end of a dimension's line.
DrawnPath Tick(const Vector2d& at, const Vector2d& along, double size_m) {
  const Vector2d slash = 0.5 * size_m * (along + LeftOf(along)).normalized();
  return {Pen::kDimension, {at - slash, at + slash}};
}

}  // namespace

std::string LengthText(double length_m, bool in_mm) {
  return in_mm ? fmt::format("{:.0f}", 1e3 * length_m) : fmt::format("{:.2f}", length_m);
}

PlanTextSizes::PlanTextSizes(int scale, bool millimetres) : in_mm(millimetres) {
  const double metres_of_mm = 1e-3 * scale;
  name_m = 3 * metres_of_mm;
  figure_m = 2 * metres_of_mm;
  small_m = 1.6 * metres_of_mm;
  gap_m = 0.8 * metres_of_mm;
  row_m = 7 * metres_of_mm;
}

Vector2d Dimension::LineEnd() const { return to + offset_m * LeftOf((to - from).normalized()); }

std::string Dimension::Text() const {
  return fmt::format("{}{}", is_about ? "~" : "", LengthText(Length(), in_mm));
}

DrawnText DimensionText(const Dimension& dimension, const PlanTextSizes& sizes) {
  const Vector2d along = (dimension.to - dimension.from).normalized();
  const double angle_rad = ReadableAngle(along);
  const Vector2d up(-std::sin(angle_rad), std::cos(angle_rad));
  // The next row is as far from the text below as that is from the line.
  const double over_m = dimension.text_row * (sizes.figure_m + sizes.gap_m) +
                        (dimension.text_row < 0 ? 0 : sizes.gap_m);
  const Vector2d on_line = dimension.from + dimension.text_at * (dimension.to - dimension.from) +
                           dimension.offset_m * LeftOf(along);
  return {dimension.Text(), on_line + over_m * up, sizes.figure_m, angle_rad};
}

Drawing DrawDimension(const Dimension& dimension, const PlanTextSizes& sizes) {
  const Vector2d along = (dimension.to - dimension.from).normalized();
  const Vector2d aside = dimension.offset_m * LeftOf(along);
  const Vector2d start = dimension.from + aside, end = dimension.to + aside;
  Drawing drawing;
  drawing.paths = {{Pen::kDimension, {start, end}},
                   Tick(start, along, sizes.figure_m),
                   Tick(end, along, sizes.figure_m)};
  if (std::abs(dimension.offset_m) > 2 * sizes.gap_m) {
    const Vector2d beyond = aside.normalized() * sizes.gap_m;
    for (const Vector2d& point : {dimension.from, dimension.to}) {
      drawing.paths.push_back({Pen::kDimension, {point + beyond, point + aside + beyond}});
    }
  }
  drawing.texts = {DimensionText(dimension, sizes)};
  return drawing;
}

}  // namespace slcmap
