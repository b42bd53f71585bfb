#include "apps/evaluation/wall_finder.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "data/option_table.h"

namespace slcmap {
namespace {

using Eigen::Vector3d;

constexpr double kLevel = 0.26;        // most of the vertical in a level axis: 15 degrees
constexpr double kBin_m = 0.01;        // of the search for offsets
constexpr double kInFront_m = 0.1;     // of a wall the camera is
constexpr double kFloorStrip_m = 0.5;  // of the length of a wall, each with points in it
constexpr double kFilled = 0.6;        // of these strips

constexpr OptionTable kFinderTable{
    Option{"thickness_m", &WallFinderOptions::thickness_m, 1e-3, 1.0},
    Option{"max_sigma_m", &WallFinderOptions::max_sigma_m, 1e-4, 1.0},
    Option{"max_gap_m", &WallFinderOptions::max_gap_m, 0.1, 100.0},
    Option{"min_length_m", &WallFinderOptions::min_length_m, 0.1, 100.0},
    Option{"min_height_m", &WallFinderOptions::min_height_m, 0.1, 100.0},
    Option{"min_points", &WallFinderOptions::min_points, 3, 1000000}};

struct Candidate {
  size_t index = 0;  // of the point
  double offset_m = 0, along_m = 0, up_m = 0;
};

// The points that a camera before them saw across a direction.
std::vector<Candidate> Before(const std::vector<PointOfPair>& points, const Trajectory& trajectory,
                              const Vector3d& normal, double max_sigma_m) {
  const Vector3d along = Vector3d::UnitZ().cross(normal).normalized();
  std::vector<Candidate> candidates;
  for (size_t i = 0; i < points.size(); ++i) {
    const auto pose = PoseAt(trajectory, points[i].stamp_ns);
    if (!pose) continue;
    const PlacedInWorld placed = InWorld(points[i].place, *pose);
    const Vector3d& p = placed.p_world;
    if (normal.dot(pose->translation - p) < kInFront_m) continue;
    if (normal.dot(placed.covariance_m2 * normal) > max_sigma_m * max_sigma_m) continue;
    candidates.push_back({i, normal.dot(p), along.dot(p), p.z()});
  }
  return candidates;
}

// The offset around which most points are; they are sorted by it.
double FullestOffset_m(const std::vector<Candidate>& sorted, double thickness_m, size_t* count) {
  double fullest_m = 0;
  *count = 0;
  size_t from = 0, to = 0;
  const double last_m = sorted.back().offset_m;
  for (double at_m = sorted.front().offset_m; at_m <= last_m; at_m += kBin_m) {
    while (sorted[from].offset_m < at_m - thickness_m) ++from;
    while (to < sorted.size() && sorted[to].offset_m <= at_m + thickness_m) ++to;
    if (to - from > *count) *count = to - from, fullest_m = at_m;
  }
  return fullest_m;
}

bool IsWall(const std::vector<Candidate>& piece, const WallFinderOptions& options) {
  if (static_cast<int>(piece.size()) < options.min_points) return false;
  const double length_m = piece.back().along_m - piece.front().along_m;
  if (length_m < options.min_length_m) return false;
  const auto [low, high] = std::minmax_element(
      piece.begin(), piece.end(), [](const auto& a, const auto& b) { return a.up_m < b.up_m; });
  if (high->up_m - low->up_m < options.min_height_m) return false;
  std::map<int64_t, int> strips;
  for (const Candidate& c : piece) ++strips[std::lround(c.along_m / kFloorStrip_m)];
  return static_cast<double>(strips.size()) > kFilled * length_m / kFloorStrip_m;
}

// Cuts what shares an offset where nothing is along it.
void AddPieces(std::vector<Candidate> layer, const WallFinderOptions& options,
               std::vector<FoundWall>* walls) {
  std::sort(layer.begin(), layer.end(),
            [](const auto& a, const auto& b) { return a.along_m < b.along_m; });
  std::vector<Candidate> piece;
  for (size_t i = 0; i <= layer.size(); ++i) {
    const bool ends =
        i == layer.size() ||
        (!piece.empty() && layer[i].along_m > piece.back().along_m + options.max_gap_m);
    if (ends && IsWall(piece, options)) {
      FoundWall wall{static_cast<int64_t>(walls->size()), {}};
      for (const Candidate& c : piece) wall.points.push_back(c.index);
      walls->push_back(std::move(wall));
    }
    if (ends) piece.clear();
    if (i < layer.size()) piece.push_back(layer[i]);
  }
}

void FindAcross(std::vector<Candidate> candidates, const WallFinderOptions& options,
                std::vector<FoundWall>* walls) {
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.offset_m < b.offset_m; });
  while (static_cast<int>(candidates.size()) >= options.min_points) {
    size_t count = 0;
    const double offset_m = FullestOffset_m(candidates, options.thickness_m, &count);
    if (static_cast<int>(count) < options.min_points) return;
    const auto in_layer = [&](const Candidate& c) {
      return std::abs(c.offset_m - offset_m) <= options.thickness_m;
    };
    std::vector<Candidate> layer;
    std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(layer), in_layer);
    std::erase_if(candidates, in_layer);
    AddPieces(std::move(layer), options, walls);
  }
}

}  // namespace

void WallFinderOptions::Check() const { kFinderTable.Check("walls", *this); }

std::vector<FoundWall> FindWalls(const std::vector<PointOfPair>& points,
                                 const Trajectory& trajectory, const Eigen::Matrix3d& axes,
                                 const WallFinderOptions& options) {
  options.Check();
  std::vector<FoundWall> walls;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(axes(2, axis)) > kLevel) continue;
    for (const double side : {1.0, -1.0}) {
      const Vector3d normal = side * Vector3d(axes(0, axis), axes(1, axis), 0).normalized();
      FindAcross(Before(points, trajectory, normal, options.max_sigma_m), options, &walls);
    }
  }
  return walls;
}

std::vector<SurveyedPoints> PlaceWalls(const std::vector<FoundWall>& walls,
                                       const std::vector<PointOfPair>& points,
                                       const Trajectory& trajectory) {
  std::vector<SurveyedPoints> placed;
  for (const FoundWall& wall : walls) {
    SurveyedPoints surveyed{wall.wall, Vector3d::Zero(), {}};
    for (const size_t index : wall.points) {
      const auto pose = PoseAt(trajectory, points[index].stamp_ns);
      if (!pose) continue;
      surveyed.points.push_back(InWorld(points[index].place, *pose));
      surveyed.seen_from_world += pose->translation;
    }
    if (surveyed.points.empty()) continue;
    surveyed.seen_from_world /= static_cast<double>(surveyed.points.size());
    placed.push_back(std::move(surveyed));
  }
  return placed;
}

}  // namespace slcmap
