#include "mapping/building/free_space.h"

#include <algorithm>
#include <cmath>

namespace slcmap {
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

int64_t FreeSpace::IndexOf(const Vector2d& point) const {
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
    const int64_t index = IndexOf(from + way * (static_cast<double>(i) / steps));
    if (index < 0 || index == last) continue;
    last = index;
    if (ways_[index] < kMostWays) ++ways_[index];
  }
}

void FreeSpace::AddWaysOf(const FreeSpace& other) {
  for (size_t i = 0; i < ways_.size(); ++i) {
    ways_[i] = static_cast<uint8_t>(std::min<int>(kMostWays, ways_[i] + other.ways_[i]));
  }
}

bool FreeSpace::IsFree(const Vector2d& point) const {
  const int64_t index = IndexOf(point);
  return index >= 0 && ways_[index] >= kLeastWays;
}

double FreeSpace::ShareOf(const Polygon& polygon) const {
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

std::optional<FreeWay> FreeWayOf(const Vector3d& p_world_camera, const Vector3d& end,
                                 double sigma_m, double floor_m, double top_m, double cell_m) {
  return ClipRay(p_world_camera, end, std::max(cell_m, kRayEndSigmas * sigma_m),
                 floor_m + kFreeSlack_m, top_m - kFreeSlack_m);
}

SightRays::SightRays(const std::vector<Sights>& sights, size_t max_rays) : sights_(sights) {
  size_t rays = 0;
  for (const Sights& view : sights) rays += view.p_world.size();
  step_ = rays / max_rays + 1;
  size_t next = 0;
  for (const Sights& view : sights) {
    first_.push_back(next);
    const size_t count = view.p_world.size();
    if (next < count) next += (count - next + step_ - 1) / step_ * step_;
    next -= count;
  }
}

}  // namespace slcmap
