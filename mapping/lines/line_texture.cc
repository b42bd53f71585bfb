#include "mapping/lines/line_texture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core/utility.hpp>

#include "data/quantile.h"
#include "mapping/lines/across.h"
#include "mapping/lines/line_cells.h"

namespace slcmap {
namespace {

constexpr double kCountStep_m = 0.1;
constexpr double kBesideEnd_m = 0.1;      // past its ends, to which a line counts as beside a place
constexpr double kMaxTurn_rad = 0.06;     // between parallel lines
constexpr double kMinDistance_m = 0.012;  // between lines that are two
constexpr double kOffPlane_m = 0.03;

// How many differ, of sorted values.
int CountApart(const std::vector<double>& sorted) {
  int count = 0;
  double last = 0;
  for (const double value : sorted) {
    if (count > 0 && value - last <= kMinDistance_m) continue;
    last = value;
    ++count;
  }
  return count;
}

bool Covers(const TrackedLine& line, double along_m) {
  return std::any_of(line.intervals.begin(), line.intervals.end(), [&](const Stretch& interval) {
    return along_m > interval.from_m - kBesideEnd_m && along_m < interval.to_m + kBesideEnd_m;
  });
}

class Neighbours {
 public:
  Neighbours(const std::vector<TrackedLine>& lines, const LineCells& cells, int index,
             double reach_m)
      : line_(lines[index].line), across_(AcrossOf(line_.direction_world)), reach_m_(reach_m) {
    for (const int other : cells.Near(index)) {
      if (other == index || lines[other].segment != lines[index].segment) continue;
      const double cosine = line_.direction_world.dot(lines[other].line.direction_world);
      if (std::abs(cosine) > std::cos(kMaxTurn_rad)) parallel_.push_back(&lines[other]);
    }
  }

  int CountAt(double along_m) const {
    const std::vector<Eigen::Vector2d> places = PlacesAt(along_m);
    int most = 0;
    for (const Eigen::Vector2d& through : places) {  // the planes through one of them
      const Eigen::Vector2d way = through.normalized();
      std::vector<double> distances_m;
      for (const Eigen::Vector2d& place : places) {
        const double off_m = way.x() * place.y() - way.y() * place.x();
        if (std::abs(off_m) < kOffPlane_m) distances_m.push_back(way.dot(place));
      }
      std::sort(distances_m.begin(), distances_m.end());
      most = std::max(most, CountApart(distances_m));
    }
    return most;
  }

 private:
  // Where the parallel lines pass the plane across the line at a place of it.
  std::vector<Eigen::Vector2d> PlacesAt(double along_m) const {
    const Eigen::Vector3d p = line_.point_world + along_m * line_.direction_world;
    std::vector<Eigen::Vector2d> places;
    for (const TrackedLine* other : parallel_) {
      const double beside_m = other->line.direction_world.dot(p - other->line.point_world);
      if (!Covers(*other, beside_m)) continue;
      const Eigen::Vector3d q = other->line.point_world + beside_m * other->line.direction_world;
      const Eigen::Vector2d place = across_.transpose() * (q - p);
      const double distance_m = place.norm();
      if (distance_m > kMinDistance_m && distance_m < reach_m_) places.push_back(place);
    }
    return places;
  }

  const PointAndDirection& line_;
  const Eigen::Matrix<double, 3, 2> across_;
  const double reach_m_;
  std::vector<const TrackedLine*> parallel_;
};

int MedianCount(const TrackedLine& line, const Neighbours& neighbours) {
  std::vector<double> counts;
  for (const Stretch& interval : line.intervals) {
    const double length_m = interval.length_m();
    const int places = std::max(1, static_cast<int>(length_m / kCountStep_m));
    for (int i = 0; i < places; ++i) {
      counts.push_back(neighbours.CountAt(interval.from_m + (i + 0.5) * length_m / places));
    }
  }
  return static_cast<int>(Quantile(std::move(counts), 0.5));
}

}  // namespace

void CountParallels(double reach_m, std::vector<TrackedLine>* lines) {
  LineCells cells(*lines);
  const auto count = static_cast<int>(lines->size());
  for (int i = 0; i < count; ++i) cells.Add(i);
  std::vector<int> parallels(lines->size());
  cv::parallel_for_({0, count}, [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      parallels[i] = MedianCount((*lines)[i], Neighbours(*lines, cells, i, reach_m));
    }
  });
  for (int i = 0; i < count; ++i) (*lines)[i].parallels = parallels[i];
}

}  // namespace slcmap
