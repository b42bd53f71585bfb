#include "apps/evaluation/report.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "data/io/file.h"

namespace slcmap::inline evaluation {
namespace {

constexpr double kWidth = 800, kHeight = 600;  // user units, as all lengths on the page here
constexpr double kLeft = 70, kRight = 20, kTop = 40, kBottom = 55;
constexpr std::size_t kMaxCurvePoints = 30000;  // a page has less than 800 columns

using Box = Eigen::AlignedBox2d;

Box DataBox(const SvgPlot& plot) {
  Box box;
  for (const SvgSeries& series : plot.series) {
    for (const Eigen::Vector2d& point : series.points) box.extend(point);
  }
  if (box.isEmpty()) return {Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 1)};
  // A margin, which also keeps a flat curve from dividing by zero.
  const Eigen::Vector2d margin = 0.05 * box.sizes() + Eigen::Vector2d::Constant(1e-9);
  return {box.min() - margin, box.max() + margin};
}

// Widens the box so that a unit is as long on both axes of the page.
Box WithEqualScale(const Box& box) {
  const Eigen::Vector2d page(kWidth - kLeft - kRight, kHeight - kTop - kBottom);
  const double units_per_length = box.sizes().cwiseQuotient(page).maxCoeff();
  return {box.center() - 0.5 * units_per_length * page,
          box.center() + 0.5 * units_per_length * page};
}

std::string Text(double x, double y, const std::string& anchor, const std::string& text,
                 const std::string& more = "") {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\"{}>{}</text>\n", x, y,
                     anchor, more, EscapeMarkup(text));
}

// Of a long curve only those points that show: of each stretch of points its first and last, and
// the furthest in every direction of the page, in their order.
std::vector<Eigen::Vector2d> Thinned(const std::vector<Eigen::Vector2d>& points) {
  if (points.size() <= kMaxCurvePoints) return points;
  constexpr std::size_t kKept = 6;
  const std::size_t stretches = kMaxCurvePoints / kKept;
  std::vector<Eigen::Vector2d> kept;
  for (std::size_t i = 0; i < stretches; ++i) {
    const std::size_t first = i * points.size() / stretches;
    const std::size_t end = (i + 1) * points.size() / stretches;
    std::array<std::size_t, kKept> shown;
    shown.fill(first);
    shown[1] = end - 1;
    for (std::size_t k = first; k < end; ++k) {
      for (int axis = 0; axis < 2; ++axis) {
        if (points[k][axis] < points[shown[2 + axis]][axis]) shown[2 + axis] = k;
        if (points[k][axis] > points[shown[4 + axis]][axis]) shown[4 + axis] = k;
      }
    }
    std::sort(shown.begin(), shown.end());
    const auto last = std::unique(shown.begin(), shown.end());
    for (auto k = shown.begin(); k != last; ++k) kept.push_back(points[*k]);
  }
  return kept;
}

// Places data on the page.
class Page {
 public:
  explicit Page(const Box& box) : box_(box) {}

  Eigen::Vector2d Place(const Eigen::Vector2d& point) const {
    const Eigen::Vector2d u = (point - box_.min()).cwiseQuotient(box_.sizes());
    return {kLeft + u.x() * (kWidth - kLeft - kRight),
            kHeight - kBottom - u.y() * (kHeight - kTop - kBottom)};
  }

  std::string Grid() const {
    std::string svg;
    for (int axis = 0; axis < 2; ++axis) {
      const double step = TickStep(box_.sizes()[axis], 8);
      const auto last = static_cast<int64_t>(std::floor(box_.max()[axis] / step));
      for (auto i = static_cast<int64_t>(std::ceil(box_.min()[axis] / step)); i <= last; ++i) {
        svg += GridLine(axis, static_cast<double>(i) * step);
      }
    }
    return svg;
  }

  std::string Drawn(const SvgSeries& series) const {
    return series.style == SvgStyle::kCurve ? Curve(series) : Segments(series);
  }

 private:
  std::string Curve(const SvgSeries& series) const {
    std::string points;
    for (const Eigen::Vector2d& point : Thinned(series.points)) {
      const Eigen::Vector2d p = Place(point);
      points += fmt::format("{:.2f},{:.2f} ", p.x(), p.y());
    }
    return fmt::format(
        "<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\" points=\"{}\"/>\n",
        series.colour, points);
  }

  std::string Segments(const SvgSeries& series) const {
    std::string path;
    for (std::size_t i = 0; i + 1 < series.points.size(); i += 2) {
      const Eigen::Vector2d a = Place(series.points[i]), b = Place(series.points[i + 1]);
      path += fmt::format("M{:.2f},{:.2f}L{:.2f},{:.2f}", a.x(), a.y(), b.x(), b.y());
    }
    return fmt::format(
        "<path fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\" stroke-linecap=\"round\" "
        "d=\"{}\"/>\n",
        series.colour, path);
  }

  std::string GridLine(int axis, double value) const {
    Eigen::Vector2d from = box_.min(), to = box_.max();
    from[axis] = to[axis] = value;
    const Eigen::Vector2d a = Place(from), b = Place(to);
    const std::string label = fmt::format("{:.6g}", value);
    return fmt::format(
               "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" "
               "stroke=\"#ddd\"/>\n",
               a.x(), a.y(), b.x(), b.y()) +
           (axis == 0 ? Text(a.x(), a.y() + 18, "middle", label)
                      : Text(a.x() - 6, a.y() + 4, "end", label));
  }

  Box box_;
};

std::string Legend(const std::vector<SvgSeries>& series) {
  std::string svg;
  double y = kTop + 20;
  for (const SvgSeries& entry : series) {
    svg += Text(kWidth - kRight - 10, y, "end", entry.label,
                fmt::format(" fill=\"{}\"", entry.colour));
    y += 18;
  }
  return svg;
}

}  // namespace

double TickStep(double range, int most_ticks) {
  const double least = range / most_ticks;
  const double power = std::pow(10, std::floor(std::log10(least)));
  for (const double factor : {1, 2, 5}) {
    if (factor * power >= least) return factor * power;
  }
  return 10 * power;
}

std::string DrawSvg(const SvgPlot& plot) {
  const Box box = DataBox(plot);
  const Page page(plot.equal_scale ? WithEqualScale(box) : box);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
      "height=\"{1}\" font-family=\"sans-serif\" font-size=\"13\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n",
      kWidth, kHeight);
  svg += page.Grid();
  for (const SvgSeries& series : plot.series) svg += page.Drawn(series);
  svg += Text(kWidth / 2, 24, "middle", plot.title, " font-size=\"16\"");
  svg += Text(kWidth / 2, kHeight - 14, "middle", plot.x_label);
  svg += Text(18, kHeight / 2, "middle", plot.y_label,
              fmt::format(" transform=\"rotate(-90 18 {})\"", kHeight / 2));
  return svg + Legend(plot.series) + "</svg>\n";
}

}  // namespace slcmap::evaluation
