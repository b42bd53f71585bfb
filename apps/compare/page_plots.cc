#include "apps/compare/page_plots.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "apps/evaluation/report.h"
#include "data/io/file.h"

namespace slcmap::inline evaluation {
namespace {

using Eigen::Vector2d;
using Box = Eigen::AlignedBox2d;

// Methods keep their colours, whichever are compared; others take what is left in turn.
constexpr std::array<std::pair<const char*, const char*>, 5> kMethodColours = {
    {{"points-mono", "#8a8a8a"},
     {"points", "#d98e00"},
     {"points-lines", "#3fa0d8"},
     {"structural", "#00916b"},
     {"slc", "#d2502a"}}};
constexpr std::array<const char*, 4> kOtherColours = {"#a04c9c", "#0060a8", "#7a6a00", "#c2577f"};
constexpr std::array<const char*, 9> kStageColours = {"#c8d5de", "#8fb3cc", "#5b8fb5",
                                                      "#2f6c97", "#e0c090", "#cf9b52",
                                                      "#a8712b", "#9fb58a", "#6d8c55"};
constexpr size_t kMaxPlotted = 1500;  // points of a path

// The distance between ticks, so that there are so many at most: 1, 2 or 5 times a power of ten.
double TickStep(double range, int most_ticks) {
  const double least = range / most_ticks;
  const double power = std::pow(10, std::floor(std::log10(least)));
  for (const double factor : {1, 2, 5}) {
    if (factor * power >= least) return factor * power;
  }
  return 10 * power;
}

std::string Svg(double width, double height, const std::string& label, const std::string& content) {
  return fmt::format("<svg viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" aria-label=\"{}\">{}</svg>\n",
                     width, height, EscapeMarkup(label), content);
}

std::string Text(double x, double y, const std::string& text, const char* anchor = "start",
                 const char* css_class = "") {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" class=\"{}\">{}</text>", x,
                     y, anchor, css_class, EscapeMarkup(text));
}

std::string Line(double x1, double y1, double x2, double y2, const char* css_class) {
  return fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" class=\"{}\"/>",
                     x1, y1, x2, y2, css_class);
}

std::string Rectangle(double x, double y, double width, double height, const std::string& fill,
                      const std::string& title) {
  return fmt::format(
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.2f}\" height=\"{:.1f}\" fill=\"{}\" "
      "rx=\"1.5\"><title>{}</title></rect>",
      x, y, std::max(0.0, width), height, fill, EscapeMarkup(title));
}

// Places metres on a drawing, x to the right and y upwards, as long on both axes.
class Plan {
 public:
  Plan(const Box& box, double width, double most_height) {
    const Vector2d size = box.sizes().cwiseMax(0.5);
    scale_ = std::min((width - 2 * kMargin) / size.x(), (most_height - 2 * kMargin) / size.y());
    height_ = size.y() * scale_ + 2 * kMargin;
    width_ = width;
    offset_ = {0.5 * width - scale_ * box.center().x(), 0.5 * height_ + scale_ * box.center().y()};
  }

  Vector2d At(const Vector2d& p) const {
    return {offset_.x() + scale_ * p.x(), offset_.y() - scale_ * p.y()};
  }
  double height() const { return height_; }

  // Numbers along the bottom and the left, in metres.
  std::string Axes() const {
    const double step_m = TickStep(std::max(width_, height_) / scale_, 5);
    std::string svg;
    const auto ticks = [&](double from_m, double to_m, const auto& draw) {
      for (double i = std::ceil(from_m / step_m); i * step_m <= to_m; ++i) draw(i * step_m);
    };
    const Vector2d low((kMargin - offset_.x()) / scale_,
                       (offset_.y() - height_ + kMargin) / scale_);
    const Vector2d high((width_ - kMargin - offset_.x()) / scale_, (offset_.y() - 10) / scale_);
    ticks(low.x(), high.x(), [&](double m) {
      const double x = At({m, 0}).x();
      svg += Line(x, height_ - 14, x, height_ - 10, "scale") +
             Text(x, height_, fmt::format("{:g}", m), "middle", "small");
    });
    ticks(low.y(), high.y(), [&](double m) {
      const double y = At({0, m}).y();
      svg += Line(26, y, 30, y, "scale") + Text(24, y + 4, fmt::format("{:g}", m), "end", "small");
    });
    return svg + Text(width_ - 4, height_, "x [m]", "end", "small") +
           Text(4, 9, "y [m]", "start", "small");
  }

 private:
  static constexpr double kMargin = 34;
  double scale_ = 1, height_ = 1, width_ = 1;
  Vector2d offset_;
};

// A ring where a path begins.
std::string DrawStart(const Trajectory& trajectory, const Plan& plan, const std::string& colour) {
  if (trajectory.empty()) return "";
  const Vector2d p = plan.At(trajectory.front().T_world_imu.translation.head<2>());
  return fmt::format(
      "<circle class=\"start\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"5\" fill=\"none\" stroke=\"{}\" "
      "stroke-width=\"2\"><title>start</title></circle>",
      p.x(), p.y(), colour);
}

std::string DrawPath(const Trajectory& trajectory, const Plan& plan, const std::string& colour,
                     double width) {
  std::string points;
  const size_t step = trajectory.size() / kMaxPlotted + 1;
  for (size_t i = 0; i < trajectory.size(); i += step) {
    const Vector2d p = plan.At(trajectory[i].T_world_imu.translation.head<2>());
    points += fmt::format("{:.1f},{:.1f} ", p.x(), p.y());
  }
  return fmt::format(
      "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" "
      "stroke-linejoin=\"round\"/>",
      points, colour, width);
}

Box PathBox(const SequenceResult& sequence) {
  Box box;
  const auto extend = [&](const Trajectory& trajectory) {
    for (const StampedPose& pose : trajectory) {
      box.extend(Vector2d(pose.T_world_imu.translation.head<2>()));
    }
  };
  extend(sequence.truth);
  if (box.isEmpty()) {
    for (const MethodResult& method : sequence.methods) extend(method.trajectory);
  }
  if (box.isEmpty()) box.extend(Vector2d(0, 0));
  return box;
}

// What all line maps of a sequence show, so that they are of one scale: the building around the
// path.
Box LineBox(const SequenceResult& sequence) {
  const Box path = PathBox(sequence);
  const Box near(path.min() - Vector2d(3, 3), path.max() + Vector2d(3, 3));
  Box box = path;
  for (const PlySegment& edge : sequence.edges) {
    box.extend(Vector2d(edge.start_world.head<2>()));
    box.extend(Vector2d(edge.end_world.head<2>()));
  }
  for (const MethodResult& method : sequence.methods) {
    for (const MapLine& line : method.lines) {
      box.extend(Vector2d(line.start_world.head<2>()));
      box.extend(Vector2d(line.end_world.head<2>()));
    }
  }
  return box.intersection(near);
}

std::string Segments(const std::vector<std::pair<Vector2d, Vector2d>>& segments, const Plan& plan,
                     const std::string& colour, double width) {
  std::string path;
  for (const auto& [start, end] : segments) {
    const Vector2d a = plan.At(start), b = plan.At(end);
    // Seen from above an upright line is a dot, which takes some length to be drawn.
    path += fmt::format("M{:.1f},{:.1f}L{:.1f},{:.1f}", a.x(), a.y(), b.x() + 0.1, b.y());
  }
  return fmt::format(
      "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-linecap=\"round\"/>",
      path, colour, width);
}

// Distances from the truth by time, in millimetres.
std::vector<Vector2d> ErrorsOverTime(const SequenceResult& sequence, const MethodResult& method) {
  std::vector<Vector2d> errors;
  const size_t step = method.trajectory.size() / kMaxPlotted + 1;
  for (size_t i = 0; i < method.trajectory.size(); i += step) {
    const StampedPose& pose = method.trajectory[i];
    const auto truth = PoseAt(sequence.truth, pose.stamp_ns);
    if (!truth) continue;
    errors.emplace_back(ToSeconds(pose.stamp_ns - sequence.truth.front().stamp_ns),
                        1e3 * (pose.T_world_imu.translation - truth->translation).norm());
  }
  return errors;
}

// The axes of a plot from zero, with their ticks.
class Axes {
 public:
  Axes(double most_x, double most_y) : most_x_(most_x), most_y_(most_y) {}

  Vector2d At(const Vector2d& p) const {
    return {kLeft + p.x() / most_x_ * (kWidth - kLeft - 10),
            kHeight - kBottom - std::min(p.y(), most_y_) / most_y_ * (kHeight - kBottom - 10)};
  }

  std::string Draw(const char* x_label, const char* y_label) const {
    std::string svg;
    for (double y = 0; y <= most_y_; y += TickStep(most_y_, 5)) {
      const Vector2d at = At({0, y});
      svg += Line(at.x(), at.y(), kWidth - 10, at.y(), "grid") +
             Text(at.x() - 5, at.y() + 3, fmt::format("{:g}", y), "end", "small");
    }
    for (double x = 0; x <= most_x_; x += TickStep(most_x_, 5)) {
      svg +=
          Text(At({x, 0}).x(), kHeight - kBottom + 14, fmt::format("{:g}", x), "middle", "small");
    }
    return svg + Text(kWidth - 10, kHeight - 2, x_label, "end", "small") +
           Text(4, 9, y_label, "start", "small");
  }

  static constexpr double kWidth = 640, kHeight = 220;

 private:
  static constexpr double kLeft = 44, kBottom = 30;
  const double most_x_, most_y_;
};

// Where bars end: in proportion, or where the longest is many times the shortest, by the logarithm,
// so that all can be read and none is cut.
class BarScale {
 public:
  BarScale(const std::vector<Ranked>& methods, const double* floor, double width)
      : most_(floor ? *floor : 0), width_(width) {
    constexpr double kManyTimes = 20;
    double least = std::numeric_limits<double>::infinity();
    const auto add = [&](double value) {
      if (value > 0) least = std::min(least, value);
    };
    if (floor) add(*floor);
    for (const Ranked& method : methods) {
      add(method.spread.mean);
      most_ = std::max(most_, method.spread.mean + method.spread.deviation);
    }
    if (most_ > kManyTimes * least) low_ = 0.5 * least;
  }
  double Length(double value) const {
    if (!(most_ > 0) || !(value > low_)) return 0;
    return width_ * (low_ > 0 ? std::log(value / low_) / std::log(most_ / low_) : value / most_);
  }
  bool is_logarithmic() const { return low_ > 0; }

 private:
  double most_, width_, low_ = 0;
};

}  // namespace

constexpr char kPlotStyle[] = R"(svg { font: 12px system-ui, sans-serif; fill: var(--ink); }
svg .small { font-size: 11px; fill: var(--soft); } .paper .small { fill: #555; }
.whisker { stroke: var(--ink); stroke-width: 1.6; } .scale { stroke: #555; stroke-width: 1; }
.floor { stroke: var(--ink); stroke-dasharray: 3 3; } .grid { stroke: var(--rule); }
)";

std::string MethodColour(const SequenceResult& sequence, size_t method) {
  const std::string& wanted = sequence.methods[method].name;
  size_t others = 0;
  for (const MethodResult& m : sequence.methods) {
    const auto own = std::find_if(kMethodColours.begin(), kMethodColours.end(),
                                  [&](const auto& entry) { return m.name == entry.first; });
    if (m.name == wanted) {
      return own != kMethodColours.end() ? own->second
                                         : kOtherColours[others % kOtherColours.size()];
    }
    others += own == kMethodColours.end();
  }
  return kOtherColours.front();
}

constexpr double kAfterNames = 92;  // of methods, before their bars

std::string BarPlot(const SequenceResult& sequence, const FigureInfo& figure, const double* floor) {
  constexpr double kWidth = 340, kRow = 19, kLetter = 6.2;
  double text_width = 0;
  for (const MethodResult& method : sequence.methods) {
    const std::string text = SpreadText(ComputeSpread(method.Values(figure.key)), figure.digits);
    text_width = std::max(text_width, kLetter * static_cast<double>(text.size()));
  }
  const BarScale scale(sequence.Of(figure), floor, kWidth - kAfterNames - text_width - 10);
  std::string svg;
  double y = 4;
  for (size_t i = 0; i < sequence.methods.size(); ++i) {
    const MethodResult& method = sequence.methods[i];
    const Spread spread = ComputeSpread(method.Values(figure.key));
    const std::string text = SpreadText(spread, figure.digits);
    svg += Text(kAfterNames - 6, y + 12, method.name, "end");
    const double end = kAfterNames + scale.Length(spread.mean);
    const double low = kAfterNames + scale.Length(spread.mean - spread.deviation);
    const double high = kAfterNames + scale.Length(spread.mean + spread.deviation);
    svg += Rectangle(kAfterNames, y + 2, end - kAfterNames, kRow - 6, MethodColour(sequence, i),
                     method.name + ": " + text + " " + figure.unit);
    if (spread.count > 1) svg += Line(low, y + 8.5, high, y + 8.5, "whisker");
    const double reach = spread.count > 1 ? high : end;
    const double beside = floor ? std::max(reach, kAfterNames + scale.Length(*floor)) : reach;
    svg += Text(beside + 5, y + 12, text, "start", "small");
    y += kRow;
  }
  if (floor) {
    const double x = kAfterNames + scale.Length(*floor);
    svg += Line(x, 2, x, y, "floor") +
           Text(std::clamp(x, 60.0, kWidth - 60), y + 10,
                fmt::format("{:.{}f} with true poses", *floor, figure.digits), "middle", "small");
    y += 12;
  }
  if (scale.is_logarithmic()) {
    svg += Text(kAfterNames, y + 10, "logarithmic, as one is many times another", "start", "small");
    y += 12;
  }
  return Svg(kWidth, y + 4, figure.label, svg);
}

std::string PathPlot(const SequenceResult& sequence) {
  const Plan plan(PathBox(sequence), Axes::kWidth, 420);
  std::string svg = DrawPath(sequence.truth, plan, "#bbbbbb", 5);
  for (size_t i = 0; i < sequence.methods.size(); ++i) {
    svg += DrawPath(sequence.methods[i].trajectory, plan, MethodColour(sequence, i), 1.4);
  }
  svg += DrawStart(sequence.truth, plan, "#888888");
  for (size_t i = 0; i < sequence.methods.size(); ++i) {
    svg += DrawStart(sequence.methods[i].trajectory, plan, MethodColour(sequence, i));
  }
  return Svg(Axes::kWidth, plan.height() + 10, "paths from above", svg + plan.Axes());
}

std::string ErrorPlot(const SequenceResult& sequence) {
  if (!sequence.true_poses) return "";
  std::vector<std::vector<Vector2d>> curves;
  std::vector<double> all_mm;
  double most_s = 1;
  for (const MethodResult& method : sequence.methods) {
    curves.push_back(ErrorsOverTime(sequence, method));
    for (const Vector2d& p : curves.back()) {
      all_mm.push_back(p.y());
      most_s = std::max(most_s, p.x());
    }
  }
  if (all_mm.empty()) return "";
  const Axes axes(most_s, std::max(1e-3, *std::max_element(all_mm.begin(), all_mm.end())));
  std::string svg = axes.Draw("time [s]", "distance from the truth [mm]");
  for (size_t i = 0; i < curves.size(); ++i) {
    std::string points;
    for (const Vector2d& p : curves[i]) {
      const Vector2d at = axes.At(p);
      points += fmt::format("{:.1f},{:.1f} ", at.x(), at.y());
    }
    svg += fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.3\"/>",
                       points, MethodColour(sequence, i));
  }
  return Svg(Axes::kWidth, Axes::kHeight, "distance from the truth over time", svg);
}

std::string LineMapPlot(const SequenceResult& sequence, const MethodResult& method) {
  constexpr double kWidth = 480;
  const Plan plan(LineBox(sequence), kWidth, 480);
  std::vector<std::pair<Vector2d, Vector2d>> segments;
  for (const PlySegment& edge : sequence.edges) {
    segments.emplace_back(edge.start_world.head<2>(), edge.end_world.head<2>());
  }
  std::string svg = Segments(segments, plan, "#cfcfcf", 1.6);
  for (const LineAxis axis :
       {LineAxis::kVertical, LineAxis::kX, LineAxis::kY, LineAxis::kSloped, LineAxis::kNone}) {
    segments.clear();
    for (const MapLine& line : method.lines) {
      if (line.axis != axis) continue;
      segments.emplace_back(line.start_world.head<2>(), line.end_world.head<2>());
    }
    if (segments.empty()) continue;
    const auto [red, green, blue] = LineColour(axis, true);
    const bool upright = axis == LineAxis::kVertical;
    svg += Segments(segments, plan, fmt::format("#{:02x}{:02x}{:02x}", red, green, blue),
                    upright ? 2.4 : 1);
  }
  return Svg(kWidth, plan.height() + 10, "lines of " + method.name, svg + plan.Axes());
}

std::string StagePlot(const SequenceResult& sequence) {
  constexpr double kWidth = Axes::kWidth, kRow = 22;
  double most = 0;
  std::vector<std::string> names;
  for (const MethodResult& method : sequence.methods) {
    double sum = 0;
    for (const StageCost& stage : method.stages) {
      sum += stage.ms_a_pair;
      if (std::find(names.begin(), names.end(), stage.name) == names.end()) {
        names.push_back(stage.name);
      }
    }
    most = std::max(most, sum);
  }
  if (!(most > 0)) return "";
  const auto colour = [&](const std::string& name) {
    const auto at = std::find(names.begin(), names.end(), name) - names.begin();
    return std::string(kStageColours[static_cast<size_t>(at) % kStageColours.size()]);
  };
  std::string svg;
  double y = 4;
  for (const MethodResult& method : sequence.methods) {
    if (method.stages.empty()) continue;
    svg += Text(kAfterNames - 6, y + 13, method.name, "end");
    double x = kAfterNames;
    for (const StageCost& stage : method.stages) {
      const double width = stage.ms_a_pair / most * (kWidth - kAfterNames - 70);
      svg += Rectangle(x, y + 2, width, kRow - 6, colour(stage.name),
                       fmt::format("{}: {:.2f} ms", stage.name, stage.ms_a_pair));
      x += width;
    }
    svg += Text(x + 5, y + 13,
                fmt::format("{:.1f} ms", (x - kAfterNames) / (kWidth - kAfterNames - 70) * most),
                "start", "small");
    y += kRow;
  }
  double x = kAfterNames;
  y += 6;
  for (const std::string& name : names) {
    const double width = 24 + 6.2 * static_cast<double>(name.size());
    if (x + width > kWidth) x = kAfterNames, y += 16;
    svg +=
        Rectangle(x, y, 10, 10, colour(name), name) + Text(x + 14, y + 9, name, "start", "small");
    x += width;
  }
  return Svg(kWidth, y + 18, "wall time by stage", svg);
}

}  // namespace slcmap::evaluation
