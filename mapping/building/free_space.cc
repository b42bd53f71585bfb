#include "mapping/building/free_space.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace slcmap::inline mapping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr uint8_t kLeastWays = 3;  // single rays may end wrongly
constexpr uint8_t kMostWays = 255;
constexpr double kFreeSlack_m = 0.1;  // over a floor and under a top rays tell nothing
constexpr double kRayEndSigmas = 3;

// The part of a ray between two heights, without what of its end is uncertain.
std::optional<FreeWay> ClipRay(const Vector3d& from, const Vector3d& to, double end_m, double low_m,
                               double high_m) {
  const Vector3d way = to - from;
  double first = 0, last = 1 - end_m / std::max(way.norm(), 1e-9);
  if (std::abs(way.z()) < 1e-9) {
    if (from.z() < low_m || from.z() > high_m) return std::nullopt;
  } else {
    const double a = (low_m - from.z()) / way.z(), b = (high_m - from.z()) / way.z();
    first = std::max(first, std::min(a, b));
    last = std::min(last, std::max(a, b));
  }
  if (first >= last) return std::nullopt;
  return FreeWay{(from + first * way).head<2>(), (from + last * way).head<2>()};
}

}  // namespace

FreeSpace::FreeSpace(const Eigen::AlignedBox2d& box, double cell_m)
    : box_(box),
      cell_m_(cell_m),
      columns_(static_cast<int64_t>(std::ceil(box.sizes().x() / cell_m)) + 1),
      rows_(static_cast<int64_t>(std::ceil(box.sizes().y() / cell_m)) + 1),
      ways_(columns_ * rows_, 0) {}

int64_t FreeSpace::FindIndex(const Vector2d& point) const {
  const Vector2d cell = (point - box_.min()) / cell_m_;
  const auto x = static_cast<int64_t>(std::floor(cell.x()));
  const auto y = static_cast<int64_t>(std::floor(cell.y()));
  return x < 0 || y < 0 || x >= columns_ || y >= rows_ ? -1 : y * columns_ + x;
}

void FreeSpace::AddWay(const Vector2d& from, const Vector2d& to) {
  const Vector2d way = to - from;
  const int steps = std::max(1, static_cast<int>(std::ceil(way.norm() / (0.7 * cell_m_))));
  int64_t last = -1;
  for (int i = 0; i <= steps; ++i) {
    const int64_t index = FindIndex(from + way * (static_cast<double>(i) / steps));
    if (index < 0 || index == last) continue;
    last = index;
    if (ways_[index] < kMostWays) ++ways_[index];
  }
}

void FreeSpace::AddWaysFrom(const FreeSpace& other) {
  for (size_t i = 0; i < ways_.size(); ++i) {
    ways_[i] = static_cast<uint8_t>(std::min<int>(kMostWays, ways_[i] + other.ways_[i]));
  }
}

bool FreeSpace::IsFree(const Vector2d& point) const {
  const int64_t index = FindIndex(point);
  return index >= 0 && ways_[index] >= kLeastWays;
}

double FreeSpace::ComputeShareFree(const Polygon& polygon) const {
  Eigen::AlignedBox2d bounds;
  for (const Vector2d& point : polygon.outline) bounds.extend(point);
  int64_t all = 0, free = 0;
  const Vector2d first = ((bounds.min() - box_.min()) / cell_m_).array().floor();
  for (double y = first.y(); box_.min().y() + y * cell_m_ < bounds.max().y(); ++y) {
    for (double x = first.x(); box_.min().x() + x * cell_m_ < bounds.max().x(); ++x) {
      const Vector2d middle = box_.min() + cell_m_ * Vector2d(x + 0.5, y + 0.5);
      if (!Contains(polygon, middle)) continue;
      ++all;
      free += IsFree(middle) ? 1 : 0;
    }
  }
  if (all == 0) return IsFree(polygon.outline.front()) ? 1 : 0;
  return static_cast<double>(free) / static_cast<double>(all);
}

Eigen::AlignedBox2d FreeSpace::FreeBox(const Eigen::Rotation2Dd& R_box_world) const {
  Eigen::AlignedBox2d free;
  for (int64_t i = 0; i < static_cast<int64_t>(ways_.size()); ++i) {
    if (ways_[i] < kLeastWays) continue;
    const Vector2d cell(static_cast<double>(i % columns_) + 0.5,
                        static_cast<double>(i / columns_) + 0.5);
    free.extend(R_box_world * Vector2d(box_.min() + cell_m_ * cell));
  }
  return free;
}

std::optional<FreeWay> FindFreeWay(const Vector3d& p_world_camera, const Vector3d& end,
                                   double sigma_m, double floor_m, double top_m, double cell_m) {
  return ClipRay(p_world_camera, end, std::max(cell_m, kRayEndSigmas * sigma_m),
                 floor_m + kFreeSlack_m, top_m - kFreeSlack_m);
}

FreeSpaceRays::FreeSpaceRays(const std::vector<ViewRays>& seen, size_t max_rays) : seen_(seen) {
  size_t rays = 0;
  for (const ViewRays& view : seen) rays += view.p_world.size();
  step_ = rays / max_rays + 1;
  size_t next = 0;
  for (const ViewRays& view : seen) {
    first_.push_back(next);
    const size_t count = view.p_world.size();
    if (next < count) next += (count - next + step_ - 1) / step_ * step_;
    next -= count;
  }
}

namespace {

constexpr double kTop_m = 0.5;          // beneath a storey's top: what reaches it is a wall
constexpr int kBeside = 2;              // columns beside a column that count with it
constexpr int kSolidRows = 3;           // that a wall has over a door
constexpr double kUnseenPasses = 0.05;  // share of cells, of which it is as if none was passed
constexpr double kLeastWall_m = 0.3;    // of columns that are walls
constexpr double kLeastWallShare = 0.25;
// Of what is beside a face, over the face itself: then the one is the wall, and the other, as a
// duct or a rail, is fixed to it.
constexpr int kMainly = 3;

struct ColumnCounts {
  int columns = 0, cells = 0, support = 0, passes = 0, others = 0;
  int top_support = 0, top_passes = 0, top_others = 0;  // in the rows at the top
  int top_behind = 0;
};

// Cells of a column and of those beside it: rays can be few.
ColumnCounts CountAround(const FaceGrid& grid, int middle) {
  const int top = grid.rows() - static_cast<int>(std::lround(kTop_m / grid.cell_m));
  ColumnCounts counts;
  const int first = std::max(0, middle - kBeside),
            last = std::min(grid.columns() - 1, middle + kBeside);
  counts.columns = last - first + 1;
  for (int column = first; column <= last; ++column) {
    for (int row = 0; row < grid.rows(); ++row) {
      const bool passed = grid.passes(row, column) > grid.hits(row, column);
      const int support = grid.support(row, column), others = grid.others(row, column);
      const bool supported = !passed && support > others, other = !passed && others > support;
      ++counts.cells;
      counts.support += supported ? 1 : 0;
      counts.passes += passed ? 1 : 0;
      counts.others += other ? 1 : 0;
      if (row < top) continue;
      counts.top_support += supported ? 1 : 0;
      counts.top_passes += passed ? 1 : 0;
      counts.top_others += other ? 1 : 0;
      counts.top_behind += other && grid.behind(row, column) > support ? 1 : 0;
    }
  }
  return counts;
}

double ComputeShareFree(const ColumnCounts& counts) {
  const int solid = kSolidRows * counts.columns;
  const double passed = static_cast<double>(counts.passes) / counts.cells;
  const double stray = kUnseenPasses * counts.cells;
  if (counts.top_passes > counts.top_support + 0.2 * stray) return 0;
  if (counts.others > kMainly * counts.support) return 0;
  if (counts.top_others > counts.top_support && counts.support < kMainly * counts.others) return 0;
  if (counts.top_support > 0 && passed < 0.3) return 1;
  if (counts.top_support >= solid) return 1;  // over a door
  if (counts.support >= solid && counts.passes <= stray) return 0.5;
  return 0;
}

// What is behind it can be seen nowhere.
bool IsSolid(const ColumnCounts& counts) {
  return counts.top_support > 0 && counts.passes <= kUnseenPasses * counts.cells;
}

// Not seen through, nor is anything behind it that reaches the top: a duct before it hides it.
bool IsUnseen(const ColumnCounts& counts) {
  return counts.passes <= kUnseenPasses * counts.cells && counts.top_behind <= counts.top_support;
}

}  // namespace

FaceGrid::FaceGrid(const Face& face, double low, double high_m, double cell)
    : from_m(face.from_m), low_m(low), cell_m(cell) {
  const int columns = std::max(1, static_cast<int>(std::ceil(face.Length() / cell)));
  const int rows = std::max(1, static_cast<int>(std::lround((high_m - low) / cell)));
  hits = cv::Mat1i::zeros(rows, columns);
  passes = cv::Mat1i::zeros(rows, columns);
  support = cv::Mat1i::zeros(rows, columns);
  others = cv::Mat1i::zeros(rows, columns);
  behind = cv::Mat1i::zeros(rows, columns);
}

bool FaceGrid::IsHit(int row, int column) const {
  return hits(row, column) > 0 && !IsPassed(row, column);
}

bool FaceGrid::IsPassed(int row, int column) const {
  return passes(row, column) >= 2 && passes(row, column) > hits(row, column);
}

void FaceGrid::CountOnFace(double along_m, double z_m, cv::Mat1i* counts) const {
  // Edges to floor and ceiling lie at its borders, on one side or the other.
  const double top_m = low_m + rows() * cell_m;
  if (z_m < low_m - cell_m || z_m >= top_m + cell_m) return;
  Count(along_m, std::clamp(z_m, low_m + 0.5 * cell_m, top_m - 0.5 * cell_m), counts);
}

void FaceGrid::Count(double along_m, double z_m, cv::Mat1i* counts) const {
  const int column = static_cast<int>(std::floor((along_m - from_m) / cell_m));
  const int row = static_cast<int>(std::floor((z_m - low_m) / cell_m));
  if (row >= 0 && column >= 0 && row < rows() && column < columns()) ++(*counts)(row, column);
}

void AddRay(const Face& face, const Vector3d& camera, const Vector3d& end, double sigma_m,
            double behind_m, FaceGrid* grid) {
  const double before = face.DistanceTo(camera.head<2>()), after = face.DistanceTo(end.head<2>());
  const double margin_m = std::max(behind_m, 3 * sigma_m);
  if (std::abs(after) <= margin_m) {
    // What is well before the face hides it; the cheeks of an opening begin at it.
    if (before <= 0 || std::abs(after) > 0.5 * margin_m) return;
    const Vector3d at = camera + std::min(before / (before - after), 1.0) * (end - camera);
    grid->AddHit(face.MeasureAlong(at.head<2>()), at.z());
    return;
  }
  if (before * after >= 0) return;
  const Vector3d at = camera + before / (before - after) * (end - camera);
  grid->AddPass(face.MeasureAlong(at.head<2>()), at.z());
}

WallCover FindCover(const FaceGrid& grid) {
  std::vector<ColumnCounts> columns;
  WallCover cover;
  std::vector<double>& shares = cover.shares;
  for (int column = 0; column < grid.columns(); ++column) {
    columns.push_back(CountAround(grid, column));
    shares.push_back(ComputeShareFree(columns.back()));
    cover.is_solid.push_back(shares.back() > 0 && IsSolid(columns.back()));
  }
  cover.measured_m = grid.cell_m * std::accumulate(shares.begin(), shares.end(), 0.0);
  // Between covered columns, a wall goes on where nobody saw anything else.
  int last = -1;
  for (int column = 0; column < grid.columns(); ++column) {
    if (shares[column] == 0) continue;
    for (int k = last + 1; last >= 0 && k < column; ++k) {
      if (IsUnseen(columns[k])) shares[k] = std::min(shares[last], shares[column]);
    }
    last = column;
  }
  return cover;
}

bool IsWall(const std::vector<double>& shares, double cell_m) {
  double covered = 0;
  for (const double share : shares) covered += share;
  return covered * cell_m >= kLeastWall_m &&
         covered >= kLeastWallShare * static_cast<double>(shares.size());
}

}  // namespace slcmap::mapping
