#include "mapping/lines/building_axes.h"

#include <algorithm>
#include <cmath>

#include "odometry/geometry/slope.h"
#include "odometry/geometry/structural_line.h"

namespace slcmap {
namespace {

constexpr double kQuarter_rad = M_PI / 2;
// Times what a run has learned: it has one standard deviation for the lines of all axes, which the
// many that hardly deviate make small. (AdjustmentOptions::deviation_scale is more, since poses
// hang on all lines at once.)
constexpr double kDeviationScale = 1.4;

double Weight(const DirectedLine& line, const AxisDetectionOptions& options) {
  return line.length_m / (1 + std::pow(line.sigma_rad / options.window_rad, 2));
}

Eigen::Vector3d FindVertical(const std::vector<DirectedLine>& lines,
                             const AxisDetectionOptions& options) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double length_m = 0;
  for (const DirectedLine& line : lines) {
    const double sense = line.direction_world.z() < 0 ? -1 : 1;
    if (sense * line.direction_world.z() < std::cos(options.max_tilt_rad)) continue;
    sum += Weight(line, options) * sense * line.direction_world;
    length_m += line.length_m;
  }
  return length_m < options.min_length_m ? up : Eigen::Vector3d(sum.normalized());
}

// The heading of a level line in [0, pi / 2), and how much it counts.
struct Heading {
  double angle_rad = 0, weight = 0, length_m = 0;
};

double Apart(double a_rad, double b_rad) {
  const double apart = std::abs(std::remainder(a_rad - b_rad, kQuarter_rad));
  return apart;
}

std::vector<Heading> LevelHeadings(const std::vector<DirectedLine>& lines,
                                   const AxisDetectionOptions& options) {
  std::vector<Heading> headings;
  for (const DirectedLine& line : lines) {
    if (std::abs(line.direction_world.z()) > std::sin(options.max_tilt_rad)) continue;
    const double angle = std::atan2(line.direction_world.y(), line.direction_world.x());
    headings.push_back(
        {std::fmod(angle + 2 * M_PI, kQuarter_rad), Weight(line, options), line.length_m});
  }
  return headings;
}

// What lines within the window around an angle sum up to; the angle is their mean.
Heading SumAround(const std::vector<Heading>& headings, double angle_rad, double window_rad) {
  Heading sum;
  double offset = 0;
  for (const Heading& heading : headings) {
    if (Apart(heading.angle_rad, angle_rad) > window_rad) continue;
    sum.weight += heading.weight;
    sum.length_m += heading.length_m;
    offset += heading.weight * std::remainder(heading.angle_rad - angle_rad, kQuarter_rad);
  }
  sum.angle_rad = angle_rad + (sum.weight > 0 ? offset / sum.weight : 0);
  return sum;
}

// What lines within half the window to each side of an angle would sum up to if each had any.
double WeightByChance(const std::vector<Heading>& headings, double window_rad) {
  double sum = 0;
  for (const Heading& heading : headings) sum += heading.weight;
  return sum * window_rad / kQuarter_rad;
}

Heading StrongestHeading(const std::vector<Heading>& headings, double window_rad) {
  Heading strongest;
  for (double angle = 0; angle < kQuarter_rad; angle += window_rad / 2) {
    const Heading sum = SumAround(headings, angle, window_rad);
    if (sum.weight > strongest.weight) strongest = sum;
  }
  for (int i = 0; i < 3; ++i) strongest = SumAround(headings, strongest.angle_rad, window_rad / 2);
  return strongest;
}

}  // namespace

std::vector<BuildingAxis> FindAxes(const std::vector<DirectedLine>& lines,
                                   const AxisDetectionOptions& options) {
  std::vector<BuildingAxis> axes = {
      {LineAxis::kVertical, -1, -1, FindVertical(lines, options), options.sigma_rad}};
  std::vector<Heading> headings = LevelHeadings(lines, options);
  const double least = options.min_over_chance * WeightByChance(headings, options.window_rad);
  double most = 0;
  for (int world = 0;; ++world) {
    const Heading heading = StrongestHeading(headings, options.window_rad);
    if (heading.length_m < options.min_length_m) break;
    if (heading.weight < std::max(least, options.min_share * most)) break;
    most = std::max(most, heading.weight);
    for (const LineAxis axis : {LineAxis::kX, LineAxis::kY}) {
      axes.push_back({axis, world, -1, AxisDirection(axis, heading.angle_rad), options.sigma_rad});
    }
    std::erase_if(headings, [&](const Heading& other) {
      return Apart(other.angle_rad, heading.angle_rad) < options.min_apart_rad;
    });
  }
  return axes;
}

std::vector<BuildingAxis> AxesOfRun(const OdometryRun& run, double min_sigma_rad) {
  const double sigma_rad = std::max(kDeviationScale * run.line_deviation_rad, min_sigma_rad);
  std::vector<BuildingAxis> axes = {
      {LineAxis::kVertical, -1, -1, AxisDirection(LineAxis::kVertical, 0), sigma_rad}};
  for (size_t i = 0; i < run.manhattan_worlds.size(); ++i) {
    const ManhattanWorld& world = run.manhattan_worlds[i];
    if (world.withdrawn) continue;
    for (const LineAxis axis : {LineAxis::kX, LineAxis::kY}) {
      axes.push_back({axis, static_cast<int>(i), world.segment,
                      AxisDirection(axis, world.heading_rad), sigma_rad});
    }
  }
  for (size_t i = 0; i < run.sloped_directions.size(); ++i) {
    const SlopedDirection& slope = run.sloped_directions[i];
    if (slope.withdrawn) continue;
    axes.push_back({LineAxis::kSloped, static_cast<int>(i), slope.segment,
                    SlopeDirection(SlopeBlock{slope.azimuth_rad, slope.elevation_rad}.data()),
                    sigma_rad});
  }
  return axes;
}

}  // namespace slcmap
